// What 32 clients cost that never read, or send rubbish: the matcher's latency with and without them, in turns; the monitor's memory.
//   node stalled.mjs BUILD_DIR MODEL FRAMES_DIR SENSOR_JSON
// Exit code 77: skipped, because this is no long run.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { connect } from "node:net";
import { monitor, run, send, serve, skipUnlessLong, until } from "./browser_support.mjs";

const clients = 32, rounds = 4, frames = 21, loops = 30, rate = 100;  // per round: 630 frames
const mostMore = 0.05, mostSpread = 0.2;  // of the p99
const mostMemory = 100;                   // MB more: a scene and a socket's buffers for each client
const median = (values) => values.toSorted((a, b) => a - b)[Math.floor(values.length / 2)];

function stall(url, number) {
  const { hostname, port } = new URL(url), socket = connect(port, hostname);
  socket.on("error", () => {});
  socket.on("close", () => {});
  socket.pause();
  const viewer = number % 4 === 1 ? "Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n" : "";
  socket.write(`GET /live HTTP/1.1\r\nHost: ${hostname}:${port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n${viewer}\r\n`);
  if (viewer) socket.write(masked(JSON.stringify({ op: "subscribe", subscriptions: [0, 1, 2].map((channelId) => ({ id: channelId, channelId })) })));
  if (number % 4 === 3) setInterval(() => socket.writable && socket.write(Buffer.alloc(1000, number)), 20).unref();
  return socket;
}

function masked(text) {
  const bytes = Buffer.from(text);
  const head = bytes.length > 125 ? [0x81, 0xfe, bytes.length >> 8, bytes.length & 255] : [0x81, 0x80 | bytes.length];
  return Buffer.concat([Buffer.from([...head, 0, 0, 0, 0]), bytes]);
}

const memory = ({ pid }) => Number(readFileSync(`/proc/${pid}/status`, "utf8").match(/VmRSS:\s*(\d+)/)[1]) / 1024;

/// Plays the test `loops` times, of which a busy machine may drop frames; the p99 of the time from a frame's arrival to its result.
async function p99(url) {
  await send("--rate", String(rate), "--loop", String(loops)).ended;
  let latencies = [];
  await until(async () => {
    const [names, ...lines] = (await (await fetch(new URL("/export/curves.csv", url))).text()).trim().split("\n");
    const column = names.split(",").indexOf("latency_ms"), status = names.split(",").indexOf("status");
    latencies = lines.map((line) => line.split(",")).filter((row) => row[status] === "ok").map((row) => Number(row[column]));
    return latencies.length >= 0.5 * frames * loops;
  }, () => `${latencies.length} results in the curves`);
  return latencies.toSorted((a, b) => a - b)[Math.floor(0.99 * latencies.length)];
}

async function main() {
  await serve("--method", "lbea");
  const program = await monitor("127.0.0.1:0", "--foxglove"), { url } = program;
  const alone = [], crowded = [];
  await p99(url);
  const before = memory(program);
  let most = before;
  for (let round = 0; round < rounds; ++round) {
    alone.push(await p99(url));
    const crowd = Array.from({ length: clients }, (_, i) => stall(url, i));
    const watch = setInterval(() => (most = Math.max(most, memory(program))), 50);
    crowded.push(await p99(url));
    clearInterval(watch);
    for (const socket of crowd) socket.destroy();
  }
  const spread = (Math.max(...alone) - Math.min(...alone)) / median(alone), more = median(crowded) / median(alone) - 1;
  console.log(`p99 in ms alone ${alone.map((v) => v.toFixed(2))}; beside ${clients} stalled and hostile clients ${crowded.map((v) => v.toFixed(2))}: ${(100 * more).toFixed(1)} % more, where the rounds alone differ by ${(100 * spread).toFixed(1)} %`);
  console.log(`memory of lbea-monitor ${before.toFixed(0)} MB, at most ${most.toFixed(0)} MB beside the clients`);
  assert.ok(most - before < mostMemory, "the monitor's memory grows with clients that do not read");
  if (spread > mostSpread) return console.log("the machine is too busy to tell whether the matcher is slower beside them: the rounds alone differ too much");
  assert.ok(more < mostMore + spread, "the matcher is slower beside the clients");
}

skipUnlessLong();
run(main);
