// What senders said beside their frames while the matcher had no room for it.
#pragma once

#include "adapters/wire/codec/messages.hpp"

#include <cstddef>
#include <deque>

namespace lbea::tool {

struct SenderWord {
  wire::Control control;
  bool ends_stream = false;  // said by a frame, for an end of the stream is a result too
};

/// Keeps few words of each session, which lead a receiver to the same account as all of them: its first one, because
/// ids count from there on; those that withhold something; ends of the stream; and its latest one.
class WaitingWords {
 public:
  static constexpr std::size_t most = 4096;  // beyond it the oldest are forgotten

  void add(const SenderWord& word);
  [[nodiscard]] bool empty() const noexcept { return words_.empty(); }
  [[nodiscard]] std::size_t size() const noexcept { return words_.size(); }
  /// The next one to tell, when there is one.
  [[nodiscard]] const SenderWord& front() const noexcept { return words_.front(); }
  void pop() { words_.pop_front(); }

 private:
  SenderWord* replaceable_by(const wire::Control& later);
  std::deque<SenderWord> words_;
};

}  // namespace lbea::tool
