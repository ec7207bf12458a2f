// What became of every capture.
#pragma once

#include "tools/shared/recording/run_audit.hpp"

namespace lbea::tool {

struct Accounts {
  struct Reason {
    wire::WireStatus status;
    std::uint64_t count;
  };
  wire::Counters counters;       // captured = matched + rejected + dropped + on the way
  bool is_by_matcher = false;    // the matcher's last counters; else counted in the recording
  std::vector<Reason> rejected;  // those that occurred
  std::vector<Reason> dropped;
};

/// The matcher's counters or, without a matcher, the recorded frames and results.
[[nodiscard]] Accounts accounts_of(const RunAudit& audit);
[[nodiscard]] Accounts accounts_of(const wire::Counters& counters);

}  // namespace lbea::tool
