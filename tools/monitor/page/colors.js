// Colors: a perceptually uniform map for values, and distinct colors for simulations. The map interpolates anchors from dark blue
// over green to yellow with equal steps of lightness.
const anchors = [[68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141], [39, 173, 129], [92, 200, 99], [170, 220, 50], [253, 231, 37]];

export const map = new Uint8Array(256 * 3);
for (let i = 0; i < 256; ++i) {
  const at = (i / 255) * (anchors.length - 1), k = Math.min(Math.floor(at), anchors.length - 2);
  for (let c = 0; c < 3; ++c) map[i * 3 + c] = Math.round(anchors[k][c] + (at - k) * (anchors[k + 1][c] - anchors[k][c]));
}

export function paint(values, lo, hi, into) {
  const scale = hi > lo ? 255 / (hi - lo) : 0;
  for (let i = 0; i < values.length; ++i) {
    const index = Math.max(0, Math.min(255, Math.round((values[i] - lo) * scale))) * 3;
    into[i * 3] = map[index];
    into[i * 3 + 1] = map[index + 1];
    into[i * 3 + 2] = map[index + 2];
  }
}

const distinct = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#7b4bb3", "#8c6d31", "#5a5f66", "#a6192e"];
export const colorOf = (simulation) => distinct[simulation % distinct.length];
export const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
