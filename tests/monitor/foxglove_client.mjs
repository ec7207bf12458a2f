// Foxglove's own client connected to lbea-monitor: it understands all messages, and receives its subscriptions until it unsubscribes.
//   node --experimental-websocket foxglove_client.mjs BUILD_DIR MODEL FRAMES_DIR SENSOR_JSON
import assert from "node:assert/strict";
import { monitor, require, run, send, serve, until } from "./browser_support.mjs";

const { FoxgloveClient } = require("@foxglove/ws-protocol");
const identifiers = { "/results": "LBRE", "/state": "LBST" };  // of the FlatBuffers in the payloads

async function main() {
  await serve("--method", "lbea");
  const { url } = await monitor("127.0.0.1:0", "--foxglove");
  const socket = new WebSocket(url.replace("http", "ws"), [FoxgloveClient.SUPPORTED_SUBPROTOCOL]), client = new FoxgloveClient({ ws: socket });
  const info = [], channels = new Map(), topics = new Map(), messages = [], statuses = [], errors = [];
  client.on("serverInfo", (event) => info.push(event));
  client.on("advertise", (advertised) => advertised.forEach((channel) => channels.set(channel.topic, channel)));
  client.on("message", (message) => messages.push(message));
  client.on("status", (status) => statuses.push(status));
  client.on("error", (error) => errors.push(error));
  await until(() => channels.size === 3, "the channels are not advertised");
  assert.equal(socket.protocol, FoxgloveClient.SUPPORTED_SUBPROTOCOL);
  assert.equal(info.length, 1);
  assert.deepEqual([...channels.keys()].sort(), ["/frames", "/results", "/state"]);
  for (const [topic, { id }] of channels) topics.set(client.subscribe(id), topic);
  const of = (topic) => messages.filter(({ subscriptionId }) => topics.get(subscriptionId) === topic);
  await until(() => of("/state").length > 0, "no state");
  const began = BigInt(Date.now()) * 1_000_000n;
  await send("--rate", "20").ended;
  await until(() => of("/results").length >= 22 && of("/frames").length > 0, () => `${[...channels.keys()].map((topic) => `${of(topic).length} of ${topic}`)}; ${errors} ${statuses.map(({ message }) => message)}`);
  for (const [topic, identifier] of Object.entries(identifiers))
    for (const { data } of of(topic)) assert.equal(Buffer.from(data.buffer, data.byteOffset + 4, 4).toString("latin1"), identifier, topic);
  for (const { data } of of("/frames")) assert.ok(data.byteLength > 12_000, `a cloud of ${data.byteLength} bytes`);
  for (const { timestamp } of of("/results")) assert.ok(timestamp >= began && timestamp <= BigInt(Date.now()) * 1_000_000n, "the time is current");
  // Clouds may be dropped with a warning when the client is too slow.
  assert.deepEqual([statuses.filter(({ level }) => level !== 1), errors], [[], []]);
  // Unsupported operations are answered with a status that it understands.
  const refusals = () => statuses.filter(({ level }) => level === 2).length;
  client.setParameters([{ name: "a", value: 1 }], "1");
  await until(() => refusals() === 1, "setting a parameter is not refused");
  for (const subscription of topics.keys()) client.unsubscribe(subscription);
  // Responses arrive in order: after this one, no earlier message is pending.
  client.setParameters([{ name: "a", value: 1 }], "2");
  await until(() => refusals() === 2, "setting a parameter is not refused again");
  const before = messages.length;
  await send("--rate", "50").ended;
  await new Promise((done) => setTimeout(done, 600));
  assert.equal(messages.length, before, "messages arrive after unsubscribing");
  assert.deepEqual(errors, []);
  client.close();
}

run(main);
