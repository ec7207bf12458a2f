// New results as a recording of their own: the same results give the same bytes.
#pragma once

#include "adapters/mcap/mcap_writer.hpp"
#include "adapters/wire/codec/codec.hpp"
#include "tools/shared/recording/run_settings.hpp"

#include <filesystem>

namespace lbea::tool {

class ResultsFile {
 public:
  /// Throws Error{write_failed}, also when the file exists.
  ResultsFile(const std::filesystem::path& file, const RunSettings& settings);
  /// Throws Error{write_failed}.
  void add(const wire::WireResult& result);
  /// Gives the file its name; without, nothing is left of it. Throws Error{write_failed}.
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
