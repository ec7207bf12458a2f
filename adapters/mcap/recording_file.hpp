// A recording's file from the start to its name: chunks with the definitions and the account that belong into them.
// What the disk does not take is the caller's to count.
#pragma once

#include "adapters/mcap/disk_tally.hpp"
#include "adapters/mcap/mcap_writer.hpp"
#include "adapters/mcap/recorder_account.hpp"
#include "adapters/mcap/repeated_definitions.hpp"

namespace lbea::mcap {

/// One thread's.
class RecordingFile {
 public:
  /// Writes the start. What is passed in outlives it, but for `start`. Throws Error{write_failed}.
  RecordingFile(mcap::Sink& sink, mcap::Compression compression, const RecordingStart& start,
                RepeatedDefinitions& definitions, DiskTally& disk);

  [[nodiscard]] bool account_is_due(std::chrono::steady_clock::time_point now) const noexcept {
    return account_.is_due(now);
  }
  /// Writes a chunk, if there is anything to write; false when the disk did not take it. Throws std::bad_alloc before
  /// anything is written.
  [[nodiscard]] bool write(mcap::Bytes notes, mcap::Bytes frames, const RecorderStatus& status);

  // The end, one after the other; false when it failed.
  [[nodiscard]] bool write_last_account(const RecorderStatus& status) noexcept;
  [[nodiscard]] bool write(const mcap::Metadata& metadata) noexcept;
  /// Whole, on the disk, and under its name.
  [[nodiscard]] bool close(const RecorderStatus& status) noexcept;

 private:
  int write_start(const RecordingStart& start);
  template <class Step>
  bool tally(const Step& step) noexcept;

  mcap::Sink& sink_;
  mcap::Writer writer_;
  RepeatedDefinitions& definitions_;
  AccountMessages account_;
  DiskTally& disk_;
  mcap::Buffer front_;  // of the chunk: definitions, the account
};

}  // namespace lbea::mcap
