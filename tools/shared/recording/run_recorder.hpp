// Records a run: every frame's cloud as it came, every result and state as it was published.
#pragma once

#include "adapters/mcap/recorder.hpp"
#include "tools/shared/intake/run_observer.hpp"
#include "tools/shared/recording/run_senders.hpp"
#include "tools/shared/recording/run_settings.hpp"

namespace lbea::tool {

class RunRecorder final : public RunObserver {
 public:
  /// Throws Error{write_failed | bad_config}; the file is FILE.partial until finish().
  RunRecorder(const std::filesystem::path& file, const mcap::RecorderConfig& config, const RunSettings& settings);
  /// The same to any sink.
  RunRecorder(std::unique_ptr<mcap::Sink> sink, const mcap::RecorderConfig& config, const RunSettings& settings);

  void frame(wire::Message message, const wire::FrameHeader& header, std::int64_t receive_ns) noexcept override;
  void result(wire::Message message, const wire::WireResult& result) noexcept override;
  void state(wire::Message message, const wire::WireState& state) noexcept override;
  [[nodiscard]] Counts counts() const noexcept override;
  [[nodiscard]] std::optional<wire::WireRecording> recording() const noexcept override;
  /// Asks the file system for the room that is left, which may take it a while: one thread, now and then.
  void look_at_disk() noexcept;

  /// Now, or when a frame was captured at or after this time on the sender's clock.
  void trigger_now() noexcept;
  void trigger_at(std::int64_t stamp_ns) noexcept { trigger_stamp_ns_ = stamp_ns; }
  [[nodiscard]] mcap::RecorderStatus status() const noexcept { return recorder_.status(); }
  /// Before finish(), by the same thread: what is known of the senders at the end.
  void note_senders(const std::vector<wire::WireSender>& senders) { recorder_.remark(to_metadata(senders)); }
  /// After the last call to any of the above.
  mcap::RecorderStatus finish() noexcept { return recorder_.finish(); }

  static constexpr std::size_t max_frame_channels = 4096;  // sessions; frames of more are lost, and counted

 private:
  struct FrameChannel {
    std::uint64_t session = 0;
    std::uint32_t id_high = 0;
    std::uint16_t channel = 0;
  };
  /// 0 when there is no room for another.
  std::uint16_t channel_of(std::uint64_t session, std::uint64_t id) noexcept;

  mcap::Recorder recorder_;
  std::filesystem::path folder_;  // empty: no file
  std::atomic<std::uint64_t> free_bytes_{wire::WireRecording::unknown};
  std::vector<FrameChannel> channels_;  // receiving thread's
  std::atomic<std::uint64_t> without_channel_{0};
  std::atomic<std::int64_t> trigger_stamp_ns_;
};

}  // namespace lbea::tool
