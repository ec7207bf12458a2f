// The quantities of interest of one test, from all of its frames but the doubtful ones.
#pragma once

#include "adapters/wire/codec/messages.hpp"

#include <map>
#include <optional>
#include <span>

namespace lbea::tool {

/// A channel in one frame.
struct ChannelMoment : ChannelValue {
  double time_s = 0;  // since the test's first frame
};

/// The same with what was forecast of its end.
struct ChannelOfFrame : ChannelValue {
  ChannelValue end{};
};

struct TestChannel {
  std::string name, unit;
  // None: no frame has a value.
  std::optional<ChannelMoment> last;
  std::optional<ChannelMoment> peak;  // of the largest magnitude, the first of equal ones
  bool has_bounds = false;            // in some frame
};

class ChannelRecord {
 public:
  /// A frame of the test, also a rejected one. Returns its values in the order of channels(); empty when doubtful.
  std::vector<ChannelOfFrame> add(const wire::WireResult& result, double time_s);

  /// Those of all frames, also of doubtful ones; names are unique.
  [[nodiscard]] std::span<const TestChannel> channels() const noexcept { return channels_; }
  [[nodiscard]] std::uint64_t frames() const noexcept { return frames_; }
  [[nodiscard]] std::uint64_t left_out() const noexcept;
  /// How many of the frames are left out, by verdict.
  [[nodiscard]] const std::map<wire::WireVerdict, std::uint64_t>& doubtful() const noexcept { return doubtful_; }

 private:
  [[nodiscard]] std::size_t place_of(const wire::WireChannel& channel, std::size_t expected);
  std::vector<TestChannel> channels_;
  std::uint64_t frames_ = 0;
  std::map<wire::WireVerdict, std::uint64_t> doubtful_;
};

}  // namespace lbea::tool
