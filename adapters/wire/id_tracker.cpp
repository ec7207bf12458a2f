#include "adapters/wire/id_tracker.hpp"

#include <algorithm>
#include <limits>

namespace lbea {

namespace {
constexpr std::size_t most_sessions = 64;
}

void IdTracker::saw(std::uint64_t session, std::uint64_t id) {
  ++uses_;
  Session* known = find(session);
  if (known == nullptr) {
    begin({session, id, uses_});
    return;
  }
  known->last_use = uses_;
  if (id <= known->last_id) {
    ++duplicates_;
    return;
  }
  const std::uint64_t gap = id - known->last_id - 1;
  missed_ += std::min(gap, std::numeric_limits<std::uint64_t>::max() - missed_);
  known->last_id = id;
}

IdTracker::Session* IdTracker::find(std::uint64_t session) {
  const auto found =
      std::find_if(recent_.begin(), recent_.end(), [&](const Session& s) { return s.session == session; });
  return found == recent_.end() ? nullptr : &*found;
}

void IdTracker::begin(const Session& session) {
  ++sessions_;
  if (recent_.size() < most_sessions) {
    recent_.push_back(session);
    return;
  }
  *std::min_element(recent_.begin(), recent_.end(),
                    [](const Session& a, const Session& b) { return a.last_use < b.last_use; }) = session;
}

}  // namespace lbea
