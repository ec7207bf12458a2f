// Cost of 32 clients that never read or send invalid data: the latency of the matcher with and without them, in turns, and the
// processor time and memory of the monitor. The clients always run: in the windows without them they connect to a stand-in, so that
// their own load on the machine is not attributed to the monitor.
//   node stalled.mjs BUILD_DIR MODEL FRAMES_DIR SENSOR_JSON
// LBEA_SERVE_OPTIONS: more options of lbea-serve. Exit code 77: skipped, because long tests are off, or because the
// machine is too busy for a decision.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import { readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { monitor, run, send, serve, skipUnlessLong, until } from "./browser_support.mjs";

const clients = 32, frames = 21, loops = 120, rate = 500;  // per window: 2,520 frames, 5 s
const leastPairs = 8, mostPairs = 24;  // 20,160 frames a side at least
const mostMore = 0.05;    // of the p99
const mostWork = 0.05;    // of a processor, more
const mostMemory = 100;   // MB more: a scene and a socket's buffers for each client
const settled = 2000;     // ms until the buffers of the clients are full
const sorted = (values) => values.toSorted((a, b) => a - b);
const share = (values, p) => sorted(values)[Math.min(values.length - 1, Math.floor(p * values.length))];
const median = (values) => (share(values, 0.5) + sorted(values)[Math.ceil(values.length / 2) - 1]) / 2;

const memory = ({ pid }) => Number(readFileSync(`/proc/${pid}/status`, "utf8").match(/VmRSS:\s*(\d+)/)[1]) / 1024;
/// Processor time so far, in s.
const work = ({ pid }) => readFileSync(`/proc/${pid}/stat`, "utf8").split(") ")[1].split(" ").slice(11, 13).reduce((sum, ticks) => sum + Number(ticks), 0) / 100;
/// Real clients run on other machines: here they get only the idle time of the processors.
const startIdle = (script, ...parameters) => spawn("chrt", ["--idle", "0", process.execPath, fileURLToPath(new URL(script, import.meta.url)), ...parameters], { stdio: ["ignore", "pipe", "inherit"] });

/// Plays the test `loops` times and returns the p99 of the latency from arrival to result. A busy machine may drop frames.
async function p99(url) {
  await send("--rate", String(rate), "--loop", String(loops), "--open-end").ended;  // one test
  let latencies = [];
  await until(async () => {
    const [names, ...lines] = (await (await fetch(new URL("/export/curves.csv", url))).text()).trim().split("\n");
    const column = names.split(",").indexOf("latency_ms"), status = names.split(",").indexOf("status");
    latencies = lines.map((line) => line.split(",")).filter((row) => row[status] === "ok").map((row) => Number(row[column]));
    return latencies.length >= 0.5 * frames * loops;
  }, () => `${latencies.length} results in the curves`);
  return share(latencies, 0.99);
}

/// One window: the p99 in ms, and the share of a processor that the monitor uses.
async function measure(program) {
  const begin = [work(program), performance.now()], latency = await p99(program.url);
  return { latency, share: (work(program) - begin[0]) / (performance.now() - begin[1]) * 1000 };
}

/// The same while the clients are connected to `url`: the monitor or the stand-in.
async function measureBeside(url, program, noteMemory) {
  const crowd = startIdle("crowd.mjs", url, String(clients)), watch = setInterval(() => noteMemory(memory(program)), 50);
  try {
    await new Promise((done) => setTimeout(done, settled));
    return await measure(program);
  } finally {
    clearInterval(watch);
    crowd.kill("SIGKILL");
  }
}

/// The 95 % confidence interval of the median ratio, from the sign test.
function bounds(ratios) {
  const n = ratios.length, chance = Array.from({ length: n + 1 }, () => 2 ** -n);
  for (let k = 1; k <= n; ++k) chance[k] = (chance[k - 1] * (n - k + 1)) / k;
  let below = 0, rank = 0;
  while (rank < n / 2 && below + chance[rank] <= 0.025) below += chance[rank++];
  return [sorted(ratios)[rank === 0 ? 0 : rank - 1], sorted(ratios)[n - Math.max(rank, 1)]];
}

const percent = (ratio) => `${(100 * ratio).toFixed(1)} %`;
const list = (windows) => windows.map(({ latency }) => latency.toFixed(2)).join(" ");

async function main() {
  const server = await serve("--method", "lbea", ...(process.env.LBEA_SERVE_OPTIONS ?? "").split(" ").filter(Boolean));
  const program = await monitor("127.0.0.1:0", "--foxglove"), alone = [], crowded = [];
  const skip = (why) => (console.log(`skipped: this machine is too busy: ${why}`), (process.exitCode = 77));
  const hasEnded = () => server.exitCode !== null || program.exitCode !== null;
  /// Whether at most half of the frames are dropped without the clients.
  const keepsUp = () => p99(program.url).then(() => true, () => false);
  if (!(await keepsUp()) && !hasEnded()) return skip("it drops frames");
  const before = memory(program);
  let most = before, ratios = [], low = 0, high = Infinity;
  const standIn = startIdle("stand_in.mjs");
  standIn.unref();
  process.on("exit", () => standIn.kill("SIGKILL"));
  const elsewhere = String(await new Promise((done) => standIn.stdout.once("data", done))).trim(), note = (now) => (most = Math.max(most, now));
  standIn.stdout.destroy();
  const isDecided = () => low > 1 + mostMore || high < 1 + mostMore;
  while (ratios.length < leastPairs || (ratios.length < mostPairs && !isDecided())) {
    // The two alternate in coming first, so that other load of the machine affects both.
    for (const isCrowded of ratios.length % 2 ? [true, false] : [false, true])
      try {
        (isCrowded ? crowded : alone).push(await measureBeside(isCrowded ? program.url : elsewhere, program, note));
      } catch (error) {
        if (hasEnded() || (isCrowded && (await keepsUp()))) throw error;
        return skip(error.message);
      }
    ratios = crowded.map(({ latency }, i) => latency / alone[i].latency);
    [low, high] = bounds(ratios);
  }
  const [quiet, busy] = [alone, crowded].map((windows) => median(windows.map(({ share }) => share)));
  console.log(`p99 in ms of ${frames * loops} frames each, with the clients elsewhere: ${list(alone)}`);
  console.log(`beside ${clients} stalled and hostile clients: ${list(crowded)}`);
  console.log(`by pairs ${percent(median(ratios) - 1)} more; with a probability of 95 % between ${percent(low - 1)} and ${percent(high - 1)}`);
  console.log(`lbea-monitor: ${percent(quiet)} of a processor without them, ${percent(busy)} beside them; ${before.toFixed(0)} MB, at most ${most.toFixed(0)} MB`);
  assert.ok(most - before < mostMemory, "the memory of the monitor grows with clients that do not read");
  assert.ok(busy - quiet < mostWork, "the monitor uses processor time for clients that do not read");
  assert.ok(low < 1 + mostMore, "the matcher is slower with the clients");
  if (!isDecided()) {
    skip("whether the matcher is slower with them is not decided");
  }
}

skipUnlessLong();
run(main);
