// Publishes the inferred field of every matched frame, of each component, hidden parts included, on its own socket and
// thread.
#pragma once

#include "tools/shared/intake/run_observer.hpp"

#include <lbea/inference.hpp>

#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

namespace lbea::tool {

/// The field's index in the model. Throws Error{bad_config} that lists the model's fields.
[[nodiscard]] std::uint32_t find_field(const Model& model, const std::string& name);

/// The field that is inferred of a component.
struct InferredField {
  std::string component;  // empty: the only one
  Model model;
  std::uint32_t field = 0;
};

class InferencePublisher final : public RunObserver {
 public:
  /// fields: one per component. Binds. Throws Error{endpoint_unavailable}.
  InferencePublisher(wire::WireContext& context, const std::string& endpoint, const wire::ServerAccess& access,
                     std::vector<InferredField> fields);

  /// Copies the estimate and the candidates. Frames without an estimate are skipped. When the thread is too slow, the
  /// oldest waiting frame is dropped, which shows as a gap in the sequence.
  void result(wire::Message message, const wire::WireResult& result) noexcept override;
  [[nodiscard]] const std::string& endpoint() const noexcept { return sink_.endpoint(); }
  [[nodiscard]] wire::ResultSink& sink() noexcept { return sink_; }  // for its peers

 private:
  struct Request {
    std::uint64_t sequence = 0, session = 0, frame_id = 0;
    std::int64_t stamp_ns = 0;
    std::size_t component = 0;
    wire::WireFit fit;
  };
  void run(const std::stop_token& stopped) noexcept;
  void publish(const Request& request);

  std::vector<InferredField> fields_;
  wire::ResultSink sink_;
  wire::Encoder encoder_;  // from here on: this class's thread
  Inferred inferred_;
  std::vector<wire::WireInference> messages_;  // of each component
  std::uint64_t requested_ = 0;                // pipeline's publishing thread
  std::mutex mutex_;                           // guards the members below
  std::condition_variable_any wake_;
  std::deque<Request> waiting_;
  std::jthread thread_;
};

}  // namespace lbea::tool
