// Takes in a crowd as lbea-monitor does and serves it nothing: what the clients themselves cost a machine that they share with the
// programs under test. Its address goes to stdout.
import { createServer } from "node:net";

const server = createServer((socket) => {
  socket.on("error", () => {});
  socket.once("data", (bytes) => {
    const isUpgrade = bytes.includes("Upgrade: websocket"), isViewer = bytes.includes("Sec-WebSocket-Protocol");
    if (!isUpgrade) return socket.pause();
    socket.write("HTTP/1.1 101 Switching Protocols\r\n\r\n");
    // Whoever talks is let go, viewers excepted.
    socket.on("data", () => isViewer || socket.destroy());
  });
});
server.listen(0, "127.0.0.1", () => console.log(`http://127.0.0.1:${server.address().port}/`));
