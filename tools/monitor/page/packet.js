// Reads what the server sends in binary: a JSON head and typed arrays behind it (packet.hpp says how).
const types = { f32: Float32Array, u16: Uint16Array, u32: Uint32Array };
const text = new TextDecoder();

export function readPacket(buffer) {
  const view = new DataView(buffer);
  if (buffer.byteLength < 8 || text.decode(new Uint8Array(buffer, 0, 4)) !== "LBMO") throw new Error("not a packet of lbea-monitor");
  const length = view.getUint32(4, true);
  const head = JSON.parse(text.decode(new Uint8Array(buffer, 8, length)));
  const begin = Math.ceil((8 + length) / 8) * 8;
  const arrays = {};
  for (const [name, { type, offset, count }] of Object.entries(head.sections)) arrays[name] = new types[type](buffer, begin + offset, count);
  return { head, arrays };
}
