// Which frame ids a receiver should have seen: gaps and repetitions, per session of a sender.
#pragma once

#include <cstdint>
#include <vector>

namespace lbea {

class IdTracker {
 public:
  /// Notes an id that arrived. Gaps count from the first id of a session on: what was sent before this
  /// receiver listened is nobody's loss. A later arrival of a missed id counts as a duplicate.
  void saw(std::uint64_t session, std::uint64_t id);

  [[nodiscard]] std::uint64_t missed() const noexcept { return missed_; }  // saturates
  [[nodiscard]] std::uint64_t duplicates() const noexcept { return duplicates_; }
  [[nodiscard]] std::uint64_t sessions() const noexcept { return sessions_; }

 private:
  struct Session {
    std::uint64_t session, last_id, last_use;
  };
  Session* find(std::uint64_t session);
  void begin(const Session& session);

  std::vector<Session> recent_;  // bounded: the least recently used one makes room
  std::uint64_t uses_ = 0, missed_ = 0, duplicates_ = 0, sessions_ = 0;
};

}  // namespace lbea
