// Foxglove's WebSocket protocol, version 1 (github.com/foxglove/ws-protocol, docs/spec.md): what a viewer is told, and
// what it may say. No sockets here.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace lbea::tool {

enum class ViewerChannel : std::uint32_t { frames, results, state };
inline constexpr std::size_t viewer_channels = 3;

/// What came on the wire, as it came: a foxglove.PointCloud, a Result, a State.
struct ViewerMessage {
  ViewerChannel channel = ViewerChannel::results;
  std::int64_t time_ns = 0;  // since 1970
  std::string payload;
};

/// The subprotocol to answer with, of those offered (with commas between them); empty when none is spoken here.
[[nodiscard]] std::string_view viewer_subprotocol(std::string_view offered) noexcept;

/// Server info and channels, in the order in which a new viewer gets them. `session` tells it whether it comes back to
/// the same server.
[[nodiscard]] std::array<std::string, 2> viewer_greeting(std::string_view session);

/// What stands before the payload of a message: opcode, subscription, time.
inline constexpr std::size_t viewer_head_bytes = 13;
[[nodiscard]] std::array<char, viewer_head_bytes> viewer_head(std::uint32_t subscription,
                                                              std::int64_t time_ns) noexcept;

enum class ViewerNotice : std::uint8_t { info, warning, error };
[[nodiscard]] std::string viewer_notice(ViewerNotice level, std::string_view sentence);

/// Which channels a viewer wants, and under which numbers of its own.
class ViewerSubscriptions {
 public:
  /// Takes in what the viewer says. Returns what is wrong with it, in a sentence; empty when nothing is.
  [[nodiscard]] std::string take(std::string_view text);
  [[nodiscard]] std::optional<std::uint32_t> number_of(ViewerChannel channel) const noexcept {
    return numbers_[static_cast<std::size_t>(channel)];
  }

 private:
  [[nodiscard]] std::string subscribe(std::uint32_t number, std::uint32_t channel);
  [[nodiscard]] std::string unsubscribe(std::uint32_t number);
  std::array<std::optional<std::uint32_t>, viewer_channels> numbers_;
};

}  // namespace lbea::tool
