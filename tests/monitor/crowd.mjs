// A crowd that wishes the monitor ill, in a process of its own. Who is thrown out comes back.
//   node crowd.mjs URL COUNT
import { connect } from "node:net";

const [url, count] = process.argv.slice(2);
const { hostname, port } = new URL(url), host = `${hostname}:${port}`;
const again = 200, chatter = 20;  // ms until one comes back; between two messages of rubbish

const upgrade = (more = "") =>
  `GET /live HTTP/1.1\r\nHost: ${host}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n${more}\r\n`;

function masked(text) {
  const bytes = Buffer.from(text), head = bytes.length > 125 ? [0x81, 0xfe, bytes.length >> 8, bytes.length & 255] : [0x81, 0x80 | bytes.length];
  return Buffer.concat([Buffer.from([...head, 0, 0, 0, 0]), bytes]);
}

const everything = masked(JSON.stringify({ op: "subscribe", subscriptions: [0, 1, 2].map((channelId) => ({ id: channelId, channelId })) }));
const kinds = [
  (socket) => socket.write(upgrade()),                                                                            // watches, and never reads
  (socket) => (socket.write(upgrade("Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n")), socket.write(everything)),   // subscribes to all, and never reads
  (socket) => socket.write(`GET / HTTP/1.1\r\nHost: ${host}\r\nX-Never-Ends: `),                                  // half a request
  (socket) => socket.write(`GET /api/model HTTP/1.1\r\nHost: ${host}\r\n\r\n`.repeat(100)),                       // asks and asks, and never reads
  (socket) => {                                                                                                   // talks rubbish
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
  // To notice that it was thrown out, the last kind has to read.
  if (kind !== kinds.at(-1)) socket.pause();
}

for (let i = 0; i < Number(count); ++i) join(kinds[i % kinds.length]);
