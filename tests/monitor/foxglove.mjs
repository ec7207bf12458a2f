// The Foxglove WebSocket protocol with an independent client: advertised channels, messages, refused connections.
//   node --experimental-websocket foxglove.mjs BUILD_DIR MODEL FRAMES_DIR SENSOR_JSON
import assert from "node:assert/strict";
import { get } from "node:http";
import { monitor, run, send, serve, stop, until } from "./browser_support.mjs";

const opcode = { message: 1 };

/// A viewer: its text messages, and the binary messages of each of its subscriptions.
async function viewer(url, protocols) {
  const socket = new WebSocket(url, protocols), told = [], messages = new Map();
  socket.binaryType = "arraybuffer";
  socket.onmessage = ({ data }) => {
    if (typeof data === "string") return told.push(JSON.parse(data));
    const view = new DataView(data), subscription = view.getUint32(1, true);
    assert.equal(view.getUint8(0), opcode.message);
    if (!messages.has(subscription)) messages.set(subscription, []);
    messages.get(subscription).push({ time_ns: view.getBigUint64(5, true), payload: Buffer.from(data, 13) });
  };
  const opened = await new Promise((done) => ((socket.onopen = () => done(true)), (socket.onerror = () => done(false))));
  return { socket, told, messages, opened, say: (words) => socket.send(JSON.stringify(words)), of: (subscription) => messages.get(subscription) ?? [] };
}

/// The response status for a viewer from a page of another site.
const statusFor = (url, origin) =>
  new Promise((done, fail) => {
    const headers = { Origin: origin, Upgrade: "websocket", Connection: "Upgrade", "Sec-WebSocket-Version": "13", "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==", "Sec-WebSocket-Protocol": "foxglove.sdk.v1" };
    const request = get(url, { headers }, (response) => (response.resume(), done(response.statusCode)));
    request.on("upgrade", (response, socket) => (socket.destroy(), done(response.statusCode)));
    request.on("error", fail);
  });

async function checkAccess(url) {
  assert.equal(await statusFor(url, "https://viewer.example"), 101);
  assert.equal(await statusFor(url, "https://evil.example"), 403);
  const secret = await monitor("0.0.0.0:0", "--foxglove", "--token", "0123456789abcdef"), closed = await monitor("127.0.0.1:0");
  assert.equal((await viewer(secret.url.replace("http", "ws"), ["foxglove.sdk.v1"])).opened, true, "the token may stay in a viewer's address");
  assert.equal((await viewer(secret.url.replace("http", "ws").replace("cdef", "cdee"), ["foxglove.sdk.v1"])).opened, false, "a wrong token");
  assert.equal((await viewer(closed.url.replace("http", "ws"), ["foxglove.sdk.v1"])).opened, false, "without --foxglove");
}

async function checkGreeting({ told, socket }, protocol) {
  await until(() => told.length >= 2, "no greeting");
  assert.equal(socket.protocol, protocol);
  assert.deepEqual(told.map(({ op }) => op), ["serverInfo", "advertise"]);
  assert.deepEqual(told[0].capabilities, []);
  const { channels } = told[1];
  assert.deepEqual(channels.map(({ topic, encoding, schemaName, schemaEncoding }) => [topic, encoding, schemaName, schemaEncoding]),
    [["/frames", "flatbuffer", "foxglove.PointCloud", "flatbuffer"], ["/results", "flatbuffer", "lbea.wire.Result", "flatbuffer"], ["/state", "flatbuffer", "lbea.wire.State", "flatbuffer"]]);
  for (const { schema } of channels) {
    assert.equal(Buffer.from(schema, "base64").toString("base64"), schema, "the schema is base64 with its padding");
    assert.equal(Buffer.from(schema, "base64").toString("latin1", 4, 8), "BFBS");
  }
  return Object.fromEntries(channels.map(({ topic, id }) => [topic, id]));
}

async function main() {
  const server = await serve("--method", "fit");
  const { url } = await monitor("127.0.0.1:0", "--foxglove", "--foxglove-origin", "https://viewer.example");
  const address = url.replace("http", "ws"), first = await viewer(address, ["foxglove.sdk.v1"]), second = await viewer(address, ["other", "foxglove.websocket.v1"]);
  const ids = await checkGreeting(first, "foxglove.sdk.v1");
  await checkGreeting(second, "foxglove.websocket.v1");
  await checkAccess(url);
  first.say({ op: "subscribe", subscriptions: [{ id: 70, channelId: ids["/results"] }, { id: 4_000_000_000, channelId: ids["/frames"] }] });
  second.say({ op: "subscribe", subscriptions: [{ id: 0, channelId: ids["/state"] }] });
  await until(() => second.of(0).length > 0, "no state");
  assert.equal(second.of(0)[0].payload.toString("latin1", 4, 8), "LBST");
  const before = BigInt(Date.now()) * 1_000_000n;
  await send("--rate", "20").ended;
  await until(() => first.of(70).length >= 22, () => `${first.of(70).length} of 22 results`);
  for (const { time_ns, payload } of first.of(70)) {
    assert.equal(payload.toString("latin1", 4, 8), "LBRE");
    assert.ok(time_ns >= before && time_ns <= BigInt(Date.now()) * 1_000_000n, "the time is current");
  }
  const clouds = first.of(4_000_000_000);
  assert.ok(clouds.length >= 1 && clouds.every(({ payload }) => payload.length > 12 * 1000), `${clouds.length} clouds`);
  assert.equal(second.messages.size, 1, "only subscribed channels are sent");
  // Invalid messages are answered with a status; unsubscribing ends a subscription.
  second.socket.send("}");
  second.say({ op: "subscribe", subscriptions: [{ id: 1, channelId: 99 }] });
  second.say({ op: "advertise", channels: [] });
  await until(() => second.told.some(({ op, level }) => op === "status" && level === 2), "no status for the invalid messages");
  first.say({ op: "unsubscribe", subscriptionIds: [70, 4_000_000_000] });
  second.say({ op: "unsubscribe", subscriptionIds: [0] });
  second.say({ op: "subscribe", subscriptions: [{ id: 5, channelId: ids["/results"] }] });
  await new Promise((done) => setTimeout(done, 200));
  const results = first.of(70).length;
  await send("--rate", "100").ended;
  await until(() => second.of(5).length >= 22, "the second viewer gets no results");
  assert.equal(first.of(70).length, results, "messages arrive after unsubscribing");
  assert.ok(!(await viewer(address, ["foxglove.other.v9"])).opened, "an unknown protocol is refused");
  for (const { socket } of [first, second]) socket.close();
  await stop(server);
}

run(main);
