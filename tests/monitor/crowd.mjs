// Hostile clients of the monitor, in a process of their own. They reconnect when they are disconnected.
//   node crowd.mjs URL COUNT
import { connect } from "node:net";

const [url, count] = process.argv.slice(2);
const { hostname, port } = new URL(url), host = `${hostname}:${port}`;
const again = 200, chatter = 20;  // ms until a client reconnects; ms between two invalid messages

const upgrade = (more = "") =>
  `GET /live HTTP/1.1\r\nHost: ${host}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n${more}\r\n`;

function masked(text) {
  const bytes = Buffer.from(text), head = bytes.length > 125 ? [0x81, 0xfe, bytes.length >> 8, bytes.length & 255] : [0x81, 0x80 | bytes.length];
  return Buffer.concat([Buffer.from([...head, 0, 0, 0, 0]), bytes]);
}

const everything = masked(JSON.stringify({ op: "subscribe", subscriptions: [0, 1, 2].map((channelId) => ({ id: channelId, channelId })) }));
const kinds = [
  (socket) => socket.write(upgrade()),                                                                            // watches but never reads
  (socket) => (socket.write(upgrade("Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n")), socket.write(everything)),   // subscribes to all channels but never reads
  (socket) => socket.write(`GET / HTTP/1.1\r\nHost: ${host}\r\nX-Never-Ends: `),                                  // sends an incomplete request
  (socket) => socket.write(`GET /api/model HTTP/1.1\r\nHost: ${host}\r\n\r\n`.repeat(100)),                       // sends requests but never reads
  (socket) => {                                                                                                   // sends invalid messages
    socket.write(upgrade());
    const timer = setInterval(() => socket.write(Buffer.alloc(1000, 7)), chatter);
    socket.on("close", () => clearInterval(timer));
  },
];

function join(kind) {
  const socket = connect({ port: Number(port), host: hostname });
  socket.on("error", () => {});
  socket.on("close", () => setTimeout(join, again, kind));
  kind(socket);
  // The last kind must read to notice that it was disconnected.
  if (kind !== kinds.at(-1)) socket.pause();
}

for (let i = 0; i < Number(count); ++i) join(kinds[i % kinds.length]);
