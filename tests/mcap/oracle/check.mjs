// Reads a recording with readers that are not ours: indexed and streamed, every checksum validated, every message
// decoded by the schema embedded in the file. Prints what it found as JSON; fails on anything that is wrong.
//   node check.mjs FILE
import { createHash } from "node:crypto";
import { open, readFile } from "node:fs/promises";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import lz4 from "@foxglove/wasm-lz4";
import * as zstd from "@foxglove/wasm-zstd";
import { ByteBuffer } from "flatbuffers";
import { Parser, Schema, Table } from "flatbuffers_reflection";

await lz4.isLoaded;
await zstd.isLoaded;
const decompressHandlers = {
  lz4: (data, size) => lz4(data, Number(size)),
  zstd: (data, size) => zstd.decompress(data, Number(size)),
};

class Fold {
  constructor() {
    this.topics = {};
    this.hash = createHash("sha256");
  }
  add(topic, message) {
    this.topics[topic] = (this.topics[topic] ?? 0) + 1;
    const head = Buffer.alloc(20);
    head.writeUInt32LE(message.sequence, 0);
    head.writeBigUInt64LE(message.logTime, 4);
    head.writeBigUInt64LE(message.publishTime, 12);
    this.hash.update(topic).update(head).update(message.data);
  }
  get result() {
    return { topics: this.topics, sha256: this.hash.digest("hex") };
  }
}

function decoder(schema) {
  if (schema.encoding === "jsonschema") {
    JSON.parse(Buffer.from(schema.data).toString());
    return (data) => JSON.parse(Buffer.from(data).toString());
  }
  const parser = new Parser(Schema.getRootAsSchema(new ByteBuffer(schema.data)));
  return (data) => parser.toObject(Table.getRootTable(new ByteBuffer(data)));
}

/// In the file's order.
async function streamed(file) {
  const reader = new McapStreamReader({ validateCrcs: true, decompressHandlers, includeChunks: false });
  const channels = new Map(), schemas = new Map(), decoders = new Map();
  const fold = new Fold(), metadata = {};
  let points = 0, statistics = null;
  const take = (record) => {
    if (record.type === "Schema") schemas.set(record.id, record);
    if (record.type === "Channel") channels.set(record.id, record);
    if (record.type === "Metadata") metadata[record.name] = Object.fromEntries(record.metadata);
    if (record.type === "Statistics") statistics = { messages: Number(record.messageCount), chunks: record.chunkCount };
    if (record.type !== "Message") return;
    const channel = channels.get(record.channelId);
    fold.add(channel.topic, record);
    if (channel.schemaId === 0) return;
    const schema = schemas.get(channel.schemaId);
    if (!decoders.has(schema.id)) decoders.set(schema.id, decoder(schema));
    const decoded = decoders.get(schema.id)(record.data);
    if (schema.name !== "foxglove.PointCloud") return;
    if (decoded.fields.map((f) => f.name).join() !== "x,y,z") throw new Error("fields of a cloud");
    if (decoded.data.length % decoded.point_stride !== 0) throw new Error("size of a cloud");
    points += decoded.data.length / decoded.point_stride;
  };
  const handle = await open(file);
  try {
    for await (const part of handle.createReadStream({ highWaterMark: 1 << 20 })) {
      reader.append(part);
      for (let record; (record = reader.nextRecord()); ) take(record);
    }
  } finally {
    await handle.close();
  }
  if (!reader.done()) throw new Error("the file ends too early");
  return { ...fold.result, metadata, points, statistics };
}

/// By the index. Messages come by time, so they are counted and compared one by one, not in order.
async function indexed(file) {
  const bytes = await readFile(file);
  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, size) => new Uint8Array(bytes.buffer, bytes.byteOffset + Number(offset), Number(size)),
  };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  const topics = {};
  let last = 0n;
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    const { topic } = reader.channelsById.get(message.channelId);
    topics[topic] = (topics[topic] ?? 0) + 1;
    if (message.logTime < last) throw new Error("times go back");
    last = message.logTime;
  }
  const metadata = [];
  for await (const record of reader.readMetadata()) metadata.push(record.name);
  return { topics, chunks: reader.chunkIndexes.length, metadata };
}

const file = process.argv[2];
const a = await streamed(file), b = await indexed(file);
for (const topic of new Set([...Object.keys(a.topics), ...Object.keys(b.topics)]))
  if (a.topics[topic] !== b.topics[topic]) throw new Error(`${topic}: ${a.topics[topic]} streamed, ${b.topics[topic]} indexed`);
if (b.chunks !== a.statistics.chunks) throw new Error("number of chunks");
if (b.metadata.join() !== Object.keys(a.metadata).join()) throw new Error("metadata");
console.log(JSON.stringify(a));
