// The connection to lbea-monitor and the messages from it.
const firstWait = 250, longestWait = 2000;  // ms until it reconnects
const types = { f32: Float32Array, u16: Uint16Array, u32: Uint32Array, u8: Uint8Array };
const text = new TextDecoder();

/// Decodes a binary message of the server: a JSON head and typed arrays. packet.hpp describes the format. A packet of several
/// components has theirs in `parts`, empty where it has none; else it is its only part.
export function readPacket(buffer, at = 0) {
  const view = new DataView(buffer, at);
  if (view.byteLength < 8 || text.decode(new Uint8Array(buffer, at, 4)) !== "LBMO") throw new Error("not a packet of lbea-monitor");
  const length = view.getUint32(4, true);
  const head = JSON.parse(text.decode(new Uint8Array(buffer, at + 8, length)));
  const begin = at + Math.ceil((8 + length) / 8) * 8;
  const arrays = {}, parts = [];
  for (const [name, { type, offset, count }] of Object.entries(head.sections)) {
    const array = new types[type](buffer, begin + offset, count);
    if (type === "u8") parts[Number(name.slice("component".length))] = readPacket(buffer, array.byteOffset);
    else arrays[name] = array;
  }
  const packet = { head, arrays, parts };
  if (parts.length === 0) parts.push(packet);
  return packet;
}

/// Keeps a WebSocket open. After a disconnection it reconnects, with increasing waits.
export function connect({ packet, opened, lost }) {
  let wait = firstWait;
  const open = () => {
    const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/live`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      wait = firstWait;
      opened();
    };
    socket.onmessage = (event) => packet(readPacket(event.data));
    socket.onclose = () => {
      lost();
      setTimeout(open, wait);
      wait = Math.min(wait * 2, longestWait);
    };
  };
  open();
}
