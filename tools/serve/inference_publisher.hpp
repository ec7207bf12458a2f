// What the cameras cannot see, frame by frame: published beside the results, on a socket and a thread of its own.
#pragma once

#include "tools/shared/intake/run_observer.hpp"

#include <lbea/inference.hpp>

#include <condition_variable>
#include <deque>
#include <mutex>
#include <string>
#include <thread>

namespace lbea::tool {

/// The field's place in the model. Throws Error{bad_config} with the fields that there are.
[[nodiscard]] std::uint32_t find_field(const Model& model, const std::string& name);

class InferencePublisher final : public RunObserver {
 public:
  /// Binds. Throws Error{endpoint_unavailable}.
  InferencePublisher(wire::WireContext& context, const std::string& endpoint, const wire::ServerAccess& access,
                     Model model, std::uint32_t field);
  ~InferencePublisher() override;

  void frame(wire::Message, const wire::FrameHeader&, std::int64_t) noexcept override {}
  /// Costs a copy of the estimate's and the candidates' names. Frames that no estimate explains are passed over; when
  /// the thread cannot follow, the oldest that waits is left out, and a gap in the sequence says so.
  void result(wire::Message message, const wire::WireResult& result) noexcept override;
  void state(wire::Message, const wire::WireState&) noexcept override {}
  [[nodiscard]] Counts counts() const noexcept override { return {}; }
  [[nodiscard]] const std::string& endpoint() const noexcept { return sink_.endpoint(); }

 private:
  struct Question {
    std::uint64_t sequence = 0, session = 0, frame_id = 0;
    std::int64_t stamp_ns = 0;
    wire::WireFit fit;
  };
  void run() noexcept;
  void answer(const Question& question);

  Model model_;
  std::uint32_t field_;
  wire::ResultSink sink_;
  wire::Encoder encoder_;  // the publishing thread's, like what follows
  Inferred inferred_;
  wire::WireInference message_;
  std::uint64_t asked_ = 0;  // the pipeline's
  std::mutex mutex_;         // of the rest
  std::condition_variable wake_;
  std::deque<Question> waiting_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace lbea::tool
