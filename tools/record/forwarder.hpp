// The way from here to the matcher. Nothing waits for it but finish().
#pragma once

#include "adapters/wire/codec/codec.hpp"
#include "adapters/wire/sockets/streams.hpp"
#include "tools/record/waiting_words.hpp"

#include <chrono>

namespace lbea::tool {

/// One thread's.
class Forwarder {
 public:
  explicit Forwarder(wire::FrameSink sink) : sink_(std::move(sink)) {}
  /// Passes a word on, now or when there is room.
  void tell(const SenderWord& word);
  /// Passes a frame on, unless there is no room for it or for a word that was said before it.
  bool send(wire::Message frame);
  /// Passes on what waits, as far as there is room; whether nothing waits any more.
  bool offer();
  /// The same with patience, and until all has left this process. The words that nobody took.
  [[nodiscard]] std::size_t finish(std::chrono::milliseconds patience);

 private:
  wire::FrameSink sink_;
  wire::Encoder encoder_;
  WaitingWords words_;
};

}  // namespace lbea::tool
