// Records a run: the cloud of every frame as received, every result and state as published.
#pragma once

#include "tools/shared/intake/run_observer.hpp"
#include "tools/shared/recording/recorder.hpp"
#include "tools/shared/recording/recording_format.hpp"

namespace lbea::tool {

class RunRecorder final : public RunObserver {
 public:
  /// The file is named FILE.partial until finish(). Throws Error{write_failed | bad_config}.
  RunRecorder(const std::filesystem::path& file, const RecorderConfig& config, const RunSettings& settings);
  /// Writes to any sink.
  RunRecorder(std::unique_ptr<mcap::Sink> sink, const RecorderConfig& config, const RunSettings& settings);

  void frame_of_test(std::int64_t stamp_ns, std::int64_t receive_ns) noexcept override;
  void frame(wire::Message message, const wire::FrameHeader& header, const Arrival& arrival) noexcept override;
  void result(wire::Message message, const wire::WireResult& result) noexcept override;
  void state(wire::Message message, const wire::WireState& state) noexcept override;
  [[nodiscard]] Counts counts() const noexcept override;
  [[nodiscard]] std::optional<wire::WireRecording> recording() const noexcept override;
  /// Asks the file system for the free space, which may take long. One thread.
  void update_free_space() noexcept;

  /// Triggers now, or at the first frame of a test that was captured at or after this time on the sender's clock.
  void trigger_now() noexcept;
  void trigger_at(std::int64_t stamp_ns) noexcept { trigger_stamp_ns_ = stamp_ns; }
  [[nodiscard]] RecorderStatus status() const noexcept { return recorder_.status(); }
  /// Stores the senders at the end of the file. Before finish(), on the same thread.
  void set_senders(const std::vector<wire::WireSender>& senders, std::uint64_t interleaved) {
    recorder_.set_last_metadata(to_metadata(senders, interleaved));
  }
  /// The last call.
  RecorderStatus finish() noexcept { return recorder_.finish(); }

  static constexpr std::size_t max_frame_channels = 4096;  // sessions; frames of further ones are lost and counted

 private:
  struct FrameChannel {
    std::uint64_t session = 0;
    std::uint32_t id_high = 0, rig = 0;
    std::uint16_t channel = 0;
  };
  /// 0 when there is no room for another channel.
  std::uint16_t channel_of(std::uint64_t session, std::uint64_t id, std::uint32_t rig) noexcept;

  Recorder recorder_;
  std::vector<std::string> rigs_;  // their names; empty: one rig
  std::filesystem::path folder_;   // empty without a file
  std::atomic<std::uint64_t> free_bytes_{wire::WireRecording::unknown};
  std::vector<FrameChannel> channels_;  // used by the receiving thread
  std::atomic<std::uint64_t> without_channel_{0};
  std::atomic<std::int64_t> trigger_stamp_ns_;
};

}  // namespace lbea::tool
