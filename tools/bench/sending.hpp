// Clouds on their way to a running lbea-serve, and its results.
#pragma once

#include "adapters/wire/codec/codec.hpp"
#include "adapters/wire/sockets/streams.hpp"
#include "tools/bench/round_trip.hpp"

#include <chrono>

namespace lbea::tool::bench {

using Clock = std::chrono::steady_clock;
inline constexpr std::chrono::seconds patience{5};

class Sending {
 public:
  /// Encodes the clouds and connects. Throws Error{endpoint_unavailable} when within five seconds nobody takes frames,
  /// or results could be missed.
  Sending(const Endpoints& endpoints, std::span<const BenchCloud> clouds);

  /// The cloud whose turn it is, under this number. False: there was no room.
  [[nodiscard]] bool send(std::uint64_t id, std::chrono::milliseconds timeout);
  [[nodiscard]] wire::ResultSource& results() noexcept { return results_; }
  [[nodiscard]] std::uint64_t session() const noexcept { return session_; }

 private:
  using Encoded = std::vector<std::uint64_t>;  // 8-byte aligned

  std::uint64_t session_;
  std::span<const BenchCloud> clouds_;
  std::vector<Encoded> messages_;
  std::vector<std::size_t> sizes_;
  wire::WireContext context_;
  wire::FrameSink frames_;
  wire::ResultSource results_;
};

}  // namespace lbea::tool::bench
