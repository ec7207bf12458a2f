#include "adapters/mcap/recording_file.hpp"

#include <lbea/lbea.hpp>

#include <cerrno>
#include <system_error>

namespace lbea::mcap {

RecordingFile::RecordingFile(mcap::Sink& sink, mcap::Compression compression, const RecordingStart& start,
                             RepeatedDefinitions& definitions, DiskTally& disk)
    : sink_(sink), writer_(sink, compression), definitions_(definitions), account_(start.status_channel), disk_(disk) {
  if (const int error = write_start(start); error != 0)
    throw Error(Status::write_failed, "the recording cannot be begun: " + std::generic_category().message(error) +
                                          "; check the folder and the free space");
  disk_.bytes = writer_.size();
}

int RecordingFile::write_start(const RecordingStart& start) {
  int error = writer_.begin(start.header);
  for (const mcap::Metadata& metadata : start.metadata)
    if (error == 0) error = writer_.metadata(metadata);
  return error;
}

/// Does what writes, and counts what came of it.
template <class Step>
bool RecordingFile::tally(const Step& step) noexcept {
  int error = 0;
  try {
    error = step();
  } catch (...) { error = ENOMEM; }
  if (error != 0) disk_.last_error = error;
  disk_.bytes = writer_.size();
  return error == 0;
}

bool RecordingFile::write(mcap::Bytes notes, mcap::Bytes frames, const RecorderStatus& status) {
  front_.clear();
  definitions_.append_when_due(front_, !notes.empty() || !frames.empty());
  account_.append_when_due(front_, status);
  if (front_.empty() && notes.empty() && frames.empty()) return true;
  const std::array<mcap::Bytes, 3> pieces{front_, notes, frames};
  const auto begin = std::chrono::steady_clock::now();
  const bool written = tally([&] { return writer_.chunk(pieces); });
  const std::int64_t taken_ns = std::chrono::nanoseconds(std::chrono::steady_clock::now() - begin).count();
  if (taken_ns > disk_.longest_write_ns) disk_.longest_write_ns = taken_ns;
  definitions_.settle(written);
  account_.settle(written);
  return written;
}

bool RecordingFile::write_last_account(const RecorderStatus& status) noexcept {
  return tally([&] {
    front_.clear();
    definitions_.append_when_due(front_, false);  // lost with the last chunk, perhaps, and the account needs its own
    account_.append_when_changed(front_, status);
    const mcap::Bytes piece = front_;
    return front_.empty() ? 0 : writer_.chunk({&piece, 1});
  });
}

bool RecordingFile::write(const mcap::Metadata& metadata) noexcept {
  return tally([&] { return writer_.metadata(metadata); });
}

bool RecordingFile::close(const RecorderStatus& status) noexcept {
  return tally([&] {
    int error = writer_.metadata(closing_metadata(status));
    if (error == 0) error = writer_.finish();
    if (error == 0) error = sink_.commit();
    return error;
  });
}

}  // namespace lbea::mcap
