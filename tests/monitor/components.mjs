// Several components, live and of a recording: what the page receives of each. lbea-replay matches the recording again, as oracle.
//   node --experimental-websocket components.mjs BUILD_DIR MODEL FRAMES_DIR SENSOR_JSON OUT_DIR OTHER_MODEL
import assert from "node:assert/strict";
import { copyFileSync } from "node:fs";
import { basename, join } from "node:path";
import { endpoint, model, otherModel, run, send, serveComponents, sockets, start, stop, until, watch } from "./browser_support.mjs";

const page = "../../tools/monitor/page";
const { headlineOf } = await import(`${page}/panels.js`), { readPacket } = await import(`${page}/connection.js`), { Rows } = await import(`${page}/rows.js`);
const anotherModel = join(process.argv[2], "tests/mcap/rail.lbea");  // of the same runs
const models = [model, otherModel], names = models.map((file) => basename(file, ".lbea")), frames = 21;

const packetOf = async (address, url) => readPacket(await (await fetch(new URL(address, url))).arrayBuffer());
const linesOf = async (address, url) => (await (await fetch(new URL(address, url))).text()).trim().split("\n");

async function checkModels(url) {
  const { head, parts } = await packetOf("/api/model", url);
  assert.deepEqual(head.components, names);
  assert.equal(parts.length, 2);
  for (const { head: described, arrays } of parts) assert.ok(described.nodes > 0 && arrays.elements.length > 0);
  return parts.map((part) => part.head.nodes);
}

/// A moment with both estimates of the same frame, as large as the models, and one cloud.
function checkScene({ head, arrays, parts }, nodes) {
  assert.ok(arrays.cloud.length > 0 && arrays.cloud.length === 4 * head.scene.cloud.points);
  parts.forEach((part, i) => {
    assert.equal(part.head.scene.frame, head.scene.frame, names[i]);
    assert.equal(part.arrays.estimate.length, 3 * nodes[i], names[i]);
    assert.equal(part.arrays.cloud, undefined, "the cloud is that of all");
    assert.equal(part.head.model_differs, false);
  });
}

/// What lbea-replay says about the test of each component: "matched: run_052 (100 %), misfit 0.71".
async function answersOf(recording) {
  const replay = start("lbea-replay", recording, ...models.flatMap((file) => ["--model", file]));
  assert.equal(await replay.ended, 0, replay.said);
  return names.map((name) => replay.printed.match(new RegExp(`^test, ${name}: (.*)$`, "m"))[1]);
}

function checkAnswers(parts, answers) {
  parts.forEach(({ head }, i) => {
    const { shown, best, why } = headlineOf(head.result, head.test);
    assert.equal(`${shown.replaceAll("_", " ")}: ${best}, misfit ${why.match(/Misfit (\S+)\. /)[1]}`, answers[i], names[i]);
  });
}

/// Plays the demo's test while a page is connected. Returns what that received.
async function playLive(recording) {
  const server = await serveComponents("--record", recording);
  const watcher = await watch("--results", endpoint("results"), "--frames", endpoint("preview"), "--http", "127.0.0.1:0");
  const nodes = await checkModels(watcher.url), rows = models.map(() => new Rows());
  let last;
  const socket = new WebSocket(`${watcher.url.replace("http", "ws")}live`);
  socket.binaryType = "arraybuffer";
  socket.onmessage = ({ data }) => {
    const packet = readPacket(data);
    packet.parts.forEach((part, i) => part.head.type === "rows" && rows[i].add(part));
    if (packet.head.health) last = packet;
  };
  await until(() => last !== undefined, "the monitor does not send anything");
  assert.equal(await send("--rate", "50").ended, 0);
  await until(() => last.parts.every(({ head }) => head.test.complete) && rows.every(({ count }) => count === frames), "the end of the test is not shown");
  await until(() => last.arrays.cloud !== undefined, "no cloud is shown");
  checkScene(last, nodes);
  for (const { head } of last.parts) assert.equal(head.result.frame, frames - 1);
  await until(() => last.head.health.counters.matched === frames, "each frame is counted once");
  const [first, other] = await Promise.all([0, 1].map((i) => linesOf(`/export/curves.csv?component=${i}`, watcher.url)));
  assert.deepEqual([first.length, other.length], [frames + 1, frames + 1]);
  assert.notDeepEqual(first, other);
  assert.deepEqual(await linesOf("/export/curves.csv", watcher.url), first);
  for (const file of ["mesh.vtu", "curves.csv"]) {
    const missing = await fetch(new URL(`/export/${file}?component=2&shape=0:0:1`, watcher.url));
    assert.equal(missing.status, 404);
    assert.match(await missing.text(), /^component= needs one of the components/);
    const saved = await fetch(new URL(`/export/${file}?component=1&shape=0:0:1`, watcher.url));
    assert.equal(saved.headers.get("content-disposition"), `attachment; filename="${names[1]}-${file}"`);
  }
  socket.close();
  for (const program of [watcher, server]) await stop(program);
  return last.parts;
}

async function checkRecording(recording, answers) {
  for (const given of [[], models.toReversed().flatMap((file) => ["--model", file])]) {
    const watcher = await watch(recording, "--http", "127.0.0.1:0", ...given), order = given.length > 0 ? [1, 0] : [0, 1];
    const { head, parts } = await packetOf("/api/model", watcher.url), nodes = parts.map((part) => part.head.nodes);
    assert.deepEqual(head.components, order.map((i) => names[i]));
    assert.equal(head.recording.frames, frames);
    for (const number of [0, frames - 1]) {
      const packet = await packetOf(`/api/recording/frame?number=${number}`, watcher.url);
      assert.deepEqual([packet.head.scene.frame, ...packet.parts.map((part) => part.head.result.frame)], [number, number, number]);
      checkScene(packet, nodes);
    }
    const last = await packetOf(`/api/recording/frame?number=${frames - 1}`, watcher.url);
    checkAnswers(order.map((i) => last.parts[i]), answers);
    const { session } = last.parts[0].head.test;
    for (const i of [0, 1]) {
      const rows = new Rows();
      rows.add(await packetOf(`/api/recording/rows?session=${session}&first=0&component=${i}`, watcher.url));
      assert.equal(rows.count, frames);
    }
    await stop(watcher);
  }
  // Regression: a replaced model was shown as a component without frames.
  const replaced = join(sockets, `${names[0]}.lbea`);
  copyFileSync(anotherModel, replaced);
  const refused = start("lbea-monitor", recording, "--http", "127.0.0.1:0", "--model", replaced, "--model", models[1]);
  assert.equal(await refused.ended, 1, refused.said);
  assert.match(refused.said, /is not a model that the frames of .* were matched with/);
  // One model shows its component, as when the recording had no other.
  const watcher = await watch(recording, "--http", "127.0.0.1:0", "--model", models[1]);
  const { head, parts } = await packetOf(`/api/recording/frame?number=${frames - 1}`, watcher.url);
  assert.equal(head.type, "snapshot");
  checkAnswers([parts[0]], [answers[1]]);
  await stop(watcher);
}

run(async () => {
  const recording = join(sockets, "run.mcap");
  const live = await playLive(recording), answers = await answersOf(recording);
  checkAnswers(live, answers);
  await checkRecording(recording, answers);
});
