#include "tools/record/forwarder.hpp"

#include <algorithm>

namespace lbea::tool {

void Forwarder::tell(const SenderWord& word) {
  words_.add(word);
  offer();
}

bool Forwarder::send(wire::Message frame) { return offer() && sink_.send(frame); }

bool Forwarder::offer() {
  for (; !words_.empty(); words_.pop()) {
    const auto& [control, ends_stream] = words_.front();
    if (!sink_.tell(ends_stream ? encoder_.end_of_stream(control.session, control.next_id) : encoder_.control(control)))
      return false;
  }
  return true;
}

std::size_t Forwarder::finish(std::chrono::milliseconds patience) {
  using Clock = std::chrono::steady_clock;
  const auto left = [deadline = Clock::now() + patience] {
    return std::chrono::duration_cast<std::chrono::milliseconds>(
        std::max(deadline - Clock::now(), Clock::duration::zero()));
  };
  while (!offer() && left().count() > 0) static_cast<void>(sink_.wait_ready(left()));
  static_cast<void>(sink_.flush(left()));
  return words_.size();
}

}  // namespace lbea::tool
