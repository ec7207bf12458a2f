// Keeps a WebSocket open: after a drop it tries again, soon at first, then every two seconds.
import { readPacket } from "./packet.js";

const firstWait = 250, longestWait = 2000;

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
