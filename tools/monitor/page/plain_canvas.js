// Flat drawings are left to the processor. Drawn by the graphics processor, the browser makes the page wait until that is done with
// everything before them, the 3D view included: seconds where it is drawn in software on a busy machine.
const { getContext } = HTMLCanvasElement.prototype;
HTMLCanvasElement.prototype.getContext = function (kind, options) {
  return getContext.call(this, kind, kind === "2d" ? { willReadFrequently: true, ...options } : options);
};
