// Accepts clients as lbea-monitor does but serves nothing: measures the load of the clients themselves on the machine. Prints its
// address to stdout.
import { createServer } from "node:net";

const server = createServer((socket) => {
  socket.on("error", () => {});
  socket.once("data", (bytes) => {
    const isUpgrade = bytes.includes("Upgrade: websocket"), isViewer = bytes.includes("Sec-WebSocket-Protocol");
    if (!isUpgrade) return socket.pause();
    socket.write("HTTP/1.1 101 Switching Protocols\r\n\r\n");
    // Disconnects clients that send messages, except viewers.
    socket.on("data", () => isViewer || socket.destroy());
  });
});
server.listen(0, "127.0.0.1", () => console.log(`http://127.0.0.1:${server.address().port}/`));
