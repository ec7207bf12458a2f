// What became of the frames that lbea-record received.
#pragma once

#include "tools/shared/intake/run_observer.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace lbea::tool {

/// Of a rig, or of all.
struct RecordTally {
  std::uint64_t received = 0;         // frames
  std::uint64_t damaged = 0;          // of these: without a point cloud that can be recorded
  std::uint64_t too_many_points = 0;  // of these: recorded, but larger than a matcher accepts
  std::uint64_t forwarded = 0;
  std::uint64_t refused = 0;               // not forwarded: the matcher had no room
  std::uint64_t undelivered = 0;           // forwarded, but the matcher has not received them
  std::uint64_t missed = 0;                // captures of which no frame arrived, withheld ones included
  std::uint64_t withheld = 0;              // of these: their sender had no room
  std::uint64_t silent = 0;                // senders that stopped without goodbye: what they withheld is unknown
  std::uint64_t interleaved = 0;           // returns to a sender while the test of another one was running
  std::uint64_t unforwarded_controls = 0;  // after the end: control messages that the matcher did not accept
  RecordTally& operator+=(const RecordTally& more) noexcept;
  /// Every capture of one test arrived as a frame, and reached the matcher too.
  [[nodiscard]] bool is_complete() const noexcept {
    return damaged == 0 && refused == 0 && undelivered == 0 && missed == 0 && silent == 0 && interleaved == 0;
  }
};

struct RunTally : RecordTally {
  struct Rig : RecordTally {
    std::string name;
  };
  std::uint64_t lost_results = 0;  // results and states that this subscriber missed
  std::vector<Rig> rigs;           // of several
  bool is_upper_bound = false;     // undelivered: what a matcher received after its last state is unknown
  [[nodiscard]] bool is_complete() const noexcept { return RecordTally::is_complete() && lost_results == 0; }
};

void print(const RunTally& tally, const RunObserver::Counts& counts, bool as_json);
/// Logs what is missing from the recording, and what the matcher did not get.
void warn_of_losses(const std::string& file, const RunTally& tally);

}  // namespace lbea::tool
