#include "tools/replay/results_file.hpp"

#include "adapters/wire/codec/codec.hpp"
#include "tools/shared/recording/topics.hpp"

#include <system_error>

namespace lbea::tool {
namespace {
constexpr std::size_t chunk_bytes = std::size_t{1} << 20;
}

ResultsFile::ResultsFile(const std::filesystem::path& file, const RunSettings& settings)
    : name_(file.string()), sink_(file), writer_(sink_) {
  const auto schema = wire::result_schema();
  check(writer_.begin({"lbea.results", "lbea " LBEA_VERSION_STRING}));
  check(writer_.metadata(to_metadata(settings)));
  check(writer_.define(
      mcap::Schema{results_schema_id, "lbea.wire.Result", "flatbuffer", {schema.begin(), schema.end()}}));
  check(
      writer_.define(mcap::Channel{results_channel, results_schema_id, std::string(results_topic), "flatbuffer", {}}));
}

void ResultsFile::add(const wire::WireResult& result) {
  const auto time = static_cast<std::uint64_t>(std::max<std::int64_t>(result.receive_ns, 0));
  mcap::append(waiting_, mcap::Message{results_channel, static_cast<std::uint32_t>(result.sequence), time, time,
                                       encoder_.result(result)});
  if (waiting_.size() >= chunk_bytes) write_chunk();
}

void ResultsFile::finish() {
  write_chunk();
  check(writer_.finish());
  check(sink_.commit());
}

void ResultsFile::write_chunk() {
  if (waiting_.empty()) return;
  const mcap::Bytes piece = waiting_;
  check(writer_.chunk({&piece, 1}));
  waiting_.clear();
}

void ResultsFile::check(int error) const {
  if (error != 0)
    throw Error(Status::write_failed, "cannot write " + name_ + ": " + std::generic_category().message(error) +
                                          "; check the folder and the free space");
}

}  // namespace lbea::tool
