// The answer of a test in the monitor's headline, in lbea-eval live and in the log. The page's panel runs without a browser.
//   node --experimental-websocket answer.mjs BUILD_DIR MODEL FRAMES_DIR SENSOR_JSON
import assert from "node:assert/strict";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { endpoint, model, monitor, run, send, sensor, serveFrom, sockets, start, stop, until } from "./browser_support.mjs";

const elements = new Map();
globalThis.document = { getElementById: (id) => elements.get(id) ?? elements.set(id, { textContent: "", hidden: false, dataset: {} }).get(id) };
const page = "../../tools/monitor/page";
const { ParameterTable, VerdictPanel } = await import(`${page}/panels.js`), { readPacket } = await import(`${page}/connection.js`);
const { channelWords, endWords } = await import(`${page}/channel_words.js`), { Rows } = await import(`${page}/rows.js`);

/// What the panel shows.
const shown = () => {
  const text = (id) => elements.get(id).textContent;
  return { verdict: elements.get("verdict-panel").dataset.verdict, word: text("verdict-word"), best: text("best"), why: text("verdict-why"), frame: text("frame-verdict"),
    warning: elements.get("pose-warning").hidden ? "" : text("pose-warning") };
};

// Regression: an unknown distance ended the update of the page.
assert.deepEqual(new ParameterTable({}).leaders({ matches: [{ simulation: 3, distance: null }, { simulation: 4, distance: 0.25 }] }), ["Distance", [[3, "-"], [4, "0.2500"]]]);

// A quantity of interest: what is known of it, and what is not.
const sure = { doubtful: false, verdict: "matched", status: "ok" }, known = { value: -12.3456, bound_90: 0.5 };
assert.deepEqual(channelWords("mm", known, sure), { value: "-12.35 \u00b1 0.50 mm", note: "(90 %)" });
assert.deepEqual(channelWords("1", { value: 0.1234, bound_90: null }, sure), { value: "0.123", note: "(interval unknown)" });
assert.equal(channelWords("mm", known, { doubtful: true, verdict: "matched", status: "low_coverage" }).note, "(frame in doubt: low coverage)");
for (const channel of [undefined, { value: null, bound_90: null }]) assert.deepEqual(channelWords("mm", channel, sure), { value: "unknown", note: "" });
assert.deepEqual(channelWords("mm", known, { doubtful: true, verdict: "no_simulation_fits", status: "ok" }), { value: "unknown", note: "(frame in doubt: no simulation fits)" });
assert.deepEqual(channelWords("mm", undefined, { doubtful: true, verdict: "refused", status: "too_few_points" }), { value: "unknown", note: "(frame in doubt: too few points)" });

const foretold = { ...known, end_value: -113.4, end_bound_90: 30 };
assert.equal(endWords("mm", foretold, sure), "At the end: -113 \u00b1 30 mm");
assert.equal(endWords("mm", { ...foretold, end_bound_90: null }, sure), "At the end: -113 mm");
assert.equal(endWords("mm", foretold, { doubtful: true }), "");
for (const channel of [undefined, known, { ...known, end_value: null }]) assert.equal(endWords("mm", channel, sure), "");

// Their curves come in parts, and are unknown where the rows have no such channel.
{
  const rows = new Rows(), head = { epoch: 1, row_values: 2, columns: ["time_s", "frame"] };
  rows.add({ head: { ...head, first: 0, channels: [{ name: "end" }, { name: "speed" }] }, arrays: { rows: new Float32Array([0, 0]), channels: new Float32Array([1, 0.5, NaN, NaN]) } });
  rows.add({ head: { ...head, first: 1 }, arrays: { rows: new Float32Array([1, 1, 2, 2]), channels: new Float32Array([2, 0.5, 20, 5, 3, 0.25, 30, NaN]) } });
  assert.equal(rows.count, 3);
  assert.deepEqual([0, 1, 2].map((r) => rows.channel(r, "speed")), [[NaN, NaN], [20, 5], [30, NaN]]);
  assert.deepEqual(rows.channel(2, "end"), [3, 0.25]);
  assert.deepEqual(rows.channel(2, "other"), [NaN, NaN]);
  rows.add({ head: { ...head, epoch: 2, first: 0, channels: [] }, arrays: { rows: new Float32Array([5, 0]), channels: new Float32Array(0) } });
  assert.deepEqual(rows.channel(0, "end"), [NaN, NaN]);
}

function sensorMovedBy(axis, mm) {
  const moved = JSON.parse(readFileSync(sensor, "utf8")), file = join(sockets, `moved_${axis}_${mm}.json`);
  for (const pose of [moved.T_reference_sensor, moved.sensor.T_reference_right]) pose[axis][3] += mm;
  writeFileSync(file, JSON.stringify(moved));
  return file;
}

/// Plays the demo's test to a matcher with this pose. Returns what the panel showed for each message of the monitor.
async function play(pose, ...more) {
  const server = await serveFrom(pose, ...more);
  const watcher = await monitor();
  const evaluation = start("lbea-eval", "live", model, "--results", endpoint("results"));
  const panel = new VerdictPanel({ unit: "mm" }), seen = [];
  const socket = new WebSocket(`${watcher.url.replace("http", "ws")}live`);
  socket.binaryType = "arraybuffer";
  socket.onmessage = ({ data }) => {
    const { head } = readPacket(data);
    if (head.type !== "snapshot") return;
    panel.update(head.result, head.test);
    seen.push({ ...shown(), complete: head.test.complete });
  };
  await until(() => seen.length > 0 && /ready/.test(evaluation.said), "the monitor and lbea-eval do not receive anything");
  const sender = send("--rate", "100");
  assert.equal(await sender.ended, 0, sender.said);
  assert.equal(await evaluation.ended, 0, evaluation.said);
  await until(() => seen.at(-1).complete, "the end of the test is not shown");
  socket.close();
  for (const program of [watcher, server]) await stop(program);
  return { seen, last: seen.at(-1), log: server.said, report: evaluation.printed, warnings: evaluation.said };
}

// Regression: the panel showed the verdict of the last frame, and eval the most likely simulation.
async function checkWrongPose() {
  const { seen, last, log, report, warnings } = await play(sensorMovedBy(2, 5), "--method", "fit", "--fixed-pose");
  assert.deepEqual([last.verdict, last.word], ["no_simulation_fits", "No simulation fits"]);
  assert.match(last.best, /^nearest: run_\d+$/);
  assert.match(last.why, /Misfit \d\.\d\d\. The test is complete\./);
  assert.match(last.frame, /^Frame 20: matched; run_\d+, step \d+/, "a frame may match alone");
  assert.ok(seen.every(({ verdict }) => verdict !== "matched"), "no frame of this test is shown as matched");
  assert.match(report, /\ntest: NO SIMULATION FITS, misfit \d\.\d\d; nearest: run_\d+\n/);
  for (const text of [last.warning, report, warnings, log]) assert.match(text, /cover only \d\d % of the undeformed component.*lbea-register/);
}

async function checkDoubtfulPose() {
  const { last, report } = await play(sensorMovedBy(1, 5), "--method", "fit", "--fixed-pose");
  assert.deepEqual([last.verdict, last.word], ["doubtful", "Matched, in doubt"]);
  assert.match(last.warning, /lbea-register/);
  assert.match(report, /\ntest: matched: .*\nwarning: .*lbea-register/);
}

async function checkRightPose() {
  const { seen, last, log, report, warnings } = await play(sensor, "--method", "fit");
  assert.deepEqual([last.verdict, last.word, last.warning], ["matched", "Matched", ""]);
  assert.match(last.best, /^run_\d+ \(\d+ %\)/);
  assert.match(last.why, /complete/);
  assert.match(report, /\ntest: matched: run_\d+ \(\d+ %\)/);
  assert.doesNotMatch(report + warnings + log, /lbea-register/);
  const [, shift] = last.frame.match(/; pose corrected by (\d+\.\d\d) mm/) ?? assert.fail(last.frame);
  assert.ok(shift < 1, last.frame);
  assert.equal(seen[0].word, "No frames yet");
}

async function checkEstimatedPose() {
  const { last, report, warnings } = await play(sensorMovedBy(2, 5), "--method", "fit");
  assert.deepEqual([last.verdict, last.word, last.warning], ["matched", "Matched", ""]);
  const [, shift, turn] = last.frame.match(/; pose corrected by (\d+\.\d\d) mm and (\d+\.\d\d)\u00B0$/) ?? assert.fail(last.frame);
  assert.ok(Math.abs(shift - 5) < 1.5 && turn < 1, last.frame);
  assert.doesNotMatch(report + warnings, /lbea-register/);
}

async function checkOtherMethod() {
  const { last, report } = await play(sensor, "--method", "lbea");
  assert.deepEqual([last.verdict, last.word], ["none", "Nearest sample"]);
  assert.match(report, /\ntest: no verdict; only method fit judges a test\n/);
}

run(async () => {
  await checkRightPose();
  await checkWrongPose();
  await checkEstimatedPose();
  if (process.env.LBEA_LONG_TESTS !== "1") return;
  await checkDoubtfulPose();
  await checkOtherMethod();
});
