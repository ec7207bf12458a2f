#include "tests/mcap/format/conformance.hpp"

#include "adapters/mcap/salvage.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <fstream>

namespace lbea::test {

using namespace lbea::mcap;

namespace {

using Json = nlohmann::json;

template <class Number>
std::string text(Number number) {
  return std::to_string(number);
}

Json numbers(Bytes data) {
  Json list = Json::array();
  for (const std::byte byte : data) list.push_back(text(static_cast<unsigned>(byte)));
  return list;
}

Json map_json(const std::map<std::uint16_t, std::uint64_t>& map) {
  Json object = Json::object();
  for (const auto& [key, value] : map) object[text(key)] = text(value);
  return object;
}

Json record(const char* type, Json fields) { return {{"type", type}, {"fields", std::move(fields)}}; }

Json chunk_index(const ChunkIndex& r) {
  return record("ChunkIndex", {{"chunk_length", text(r.chunk_length)},
                               {"chunk_start_offset", text(r.chunk_start)},
                               {"compressed_size", text(r.compressed_size)},
                               {"compression", r.compression},
                               {"message_end_time", text(r.end_time)},
                               {"message_index_length", text(r.message_index_length)},
                               {"message_index_offsets", map_json(r.message_index_offsets)},
                               {"message_start_time", text(r.start_time)},
                               {"uncompressed_size", text(r.uncompressed_size)}});
}

Json statistics(const Statistics& r) {
  return record("Statistics", {{"attachment_count", text(r.attachments)},
                               {"channel_count", text(r.channels)},
                               {"channel_message_counts", map_json(r.messages_by_channel)},
                               {"chunk_count", text(r.chunks)},
                               {"message_count", text(r.messages)},
                               {"message_end_time", text(r.end_time)},
                               {"message_start_time", text(r.start_time)},
                               {"metadata_count", text(r.metadata)},
                               {"schema_count", text(r.schemas)}});
}

Json attachment(const Attachment& r) {
  return record("Attachment", {{"create_time", text(r.create_time)},
                               {"data", numbers(r.data)},
                               {"log_time", text(r.log_time)},
                               {"media_type", r.media_type},
                               {"name", r.name}});
}

Json attachment_index(const AttachmentIndex& r) {
  return record("AttachmentIndex", {{"create_time", text(r.create_time)},
                                    {"data_size", text(r.data_size)},
                                    {"length", text(r.length)},
                                    {"log_time", text(r.log_time)},
                                    {"media_type", r.media_type},
                                    {"name", r.name},
                                    {"offset", text(r.offset)}});
}

Json message(const Message& r) {
  return record("Message", {{"channel_id", text(r.channel_id)},
                            {"data", numbers(r.data)},
                            {"log_time", text(r.log_time)},
                            {"publish_time", text(r.publish_time)},
                            {"sequence", text(r.sequence)}});
}

Json channel(const Channel& r) {
  return record("Channel", {{"id", text(r.id)},
                            {"message_encoding", r.message_encoding},
                            {"metadata", r.metadata},
                            {"schema_id", text(r.schema_id)},
                            {"topic", r.topic}});
}

Json small_record(const Record& r) {
  switch (r.opcode) {
    case Opcode::header: {
      const auto h = *parse<Header>(r.content);
      return record("Header", {{"library", h.library}, {"profile", h.profile}});
    }
    case Opcode::footer: {
      const auto f = *parse<Footer>(r.content);
      return record("Footer", {{"summary_crc", text(f.summary_crc)},
                               {"summary_offset_start", text(f.summary_offset_start)},
                               {"summary_start", text(f.summary_start)}});
    }
    case Opcode::schema: {
      const auto s = *parse<Schema>(r.content);
      return record("Schema",
                    {{"data", numbers(s.data)}, {"encoding", s.encoding}, {"id", text(s.id)}, {"name", s.name}});
    }
    case Opcode::metadata: {
      const auto m = *parse<Metadata>(r.content);
      return record("Metadata", {{"metadata", m.texts}, {"name", m.name}});
    }
    case Opcode::metadata_index: {
      const auto m = *parse<MetadataIndex>(r.content);
      return record("MetadataIndex", {{"length", text(m.length)}, {"name", m.name}, {"offset", text(m.offset)}});
    }
    case Opcode::summary_offset: {
      const auto s = *parse<SummaryOffset>(r.content);
      return record("SummaryOffset", {{"group_length", text(s.group_length)},
                                      {"group_opcode", text(static_cast<unsigned>(s.group))},
                                      {"group_start", text(s.group_start)}});
    }
    default:
      return record("DataEnd", {{"data_section_crc", text(parse<DataEnd>(r.content)->data_section_crc)}});
  }
}

Json to_json(const Record& r) {
  switch (r.opcode) {
    case Opcode::channel:
      return channel(*parse<Channel>(r.content));
    case Opcode::message:
      return message(*parse<Message>(r.content));
    case Opcode::chunk_index:
      return chunk_index(*parse<ChunkIndex>(r.content));
    case Opcode::statistics:
      return statistics(*parse<Statistics>(r.content));
    case Opcode::attachment:
      return attachment(*parse<Attachment>(r.content));
    case Opcode::attachment_index:
      return attachment_index(*parse<AttachmentIndex>(r.content));
    default:
      return small_record(r);
  }
}

/// The suite's file lists fields as [name, value] pairs.
Json expected_records(const std::filesystem::path& file) {
  std::ifstream in(file);
  Json records = Json::parse(in).at("records");
  for (Json& entry : records) {
    Json fields = Json::object();
    for (const Json& field : entry["fields"]) fields[field[0].get<std::string>()] = field[1];
    entry["fields"] = std::move(fields);
  }
  return records;
}

}  // namespace

Json list_records(const ByteSource& source) {
  Json list = Json::array();
  FileReader reader(source, magic.size(), source.size() - magic.size());
  while (const auto found = reader.next()) {
    if (found->opcode == Opcode::message_index) continue;
    if (found->opcode != Opcode::chunk) {
      list.push_back(to_json(*found));
      continue;
    }
    OpenChunk chunk(source.size());
    REQUIRE(chunk.open(found->content) == ChunkDamage::none);
    Bytes rest = chunk.records();
    std::uint64_t offset = 0;
    while (const auto inner = next_record(rest, offset)) list.push_back(to_json(*inner));
    CHECK(rest.empty());
  }
  CHECK(reader.position() == source.size() - magic.size());
  return list;
}

std::size_t check_conformance(const std::filesystem::path& folder) {
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != ".mcap") continue;
    CAPTURE(entry.path().string());
    ++files;
    const FileSource source(entry.path());
    const Json expected = expected_records(std::filesystem::path(entry.path()).replace_extension(".json"));
    CHECK(list_records(source) == expected);
    const FileCheck found = check_file(source);
    for (const std::string& error : found.errors) CHECK_MESSAGE(false, error);
    CHECK(found.is_intact());
    const auto messages =
        std::ranges::count(expected, "Message", [](const Json& r) { return r["type"].get<std::string>(); });
    CHECK(found.counted.messages == static_cast<std::uint64_t>(messages));
  }
  return files;
}

}  // namespace lbea::test
