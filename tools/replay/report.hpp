// The output of a replay: lines, JSON, and a file of results.
#pragma once

#include "adapters/mcap/writer.hpp"
#include "adapters/wire/codec/codec.hpp"
#include "tools/replay/comparison.hpp"

namespace lbea::tool {

[[nodiscard]] std::string result_header();
/// A line of a table, or a JSON object.
[[nodiscard]] std::string result_line(const wire::WireResult& result);
[[nodiscard]] std::string result_json(const wire::WireResult& result);

[[nodiscard]] std::string comparison_line(const ComparisonTally& tally);
[[nodiscard]] std::string comparison_json(const ComparisonTally& tally);

/// A recording of results only. The same results give the same bytes.
class ResultsFile {
 public:
  /// Throws Error{write_failed}, also when the file exists.
  ResultsFile(const std::filesystem::path& file, const RunSettings& settings);
  /// Throws Error{write_failed}.
  void add(const wire::WireResult& result);
  /// Gives the file its final name. Without this call, no file remains. Throws Error{write_failed}.
  void finish();

 private:
  void check(int error) const;
  void write_chunk();
  std::string name_;
  mcap::PartialFile sink_;
  mcap::Writer writer_;
  mcap::Buffer waiting_;
  wire::Encoder encoder_;
};

}  // namespace lbea::tool
