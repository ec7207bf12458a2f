#include "tools/serve/pipeline/inference_publisher.hpp"

namespace lbea::tool {
namespace {

constexpr int inferences_held = 100;      // per subscriber
constexpr std::size_t max_waiting = 256;  // a quarter of a second at 1,000 frames a second

}  // namespace

std::uint32_t find_field(const Model& model, const std::string& name) {
  std::string known;
  for (std::uint32_t field = 0; field < model.fields(); ++field) {
    if (model.field(field).name == name) return field;
    known += (known.empty() ? "" : ", ") + std::string(model.field(field).name);
  }
  throw Error(Status::bad_config,
              "the model has no field " + name +
                  (known.empty() ? "; bake it with fields = [\"" + name + "\"]" : "; it has " + known));
}

InferencePublisher::InferencePublisher(wire::WireContext& context, const std::string& endpoint,
                                       const wire::ServerAccess& access, Model model, std::uint32_t field)
    : model_(std::move(model)), field_(field), sink_(context, endpoint, inferences_held, access) {
  const FieldInfo info = model_.field(field_);
  message_ = {.field = std::string(info.name),
              .unit = std::string(info.unit),
              .location = info.location,
              .model_checksum = model_.checksum()};
  thread_ = std::jthread([this](const std::stop_token& stopped) { run(stopped); });
}

void InferencePublisher::result(wire::Message, const wire::WireResult& result) noexcept {
  if (result.fit.estimate.empty()) return;
  const std::lock_guard lock(mutex_);
  if (waiting_.size() == max_waiting) waiting_.pop_front();
  waiting_.push_back({++requested_, result.session, result.frame_id, result.stamp_ns, result.fit});
  wake_.notify_one();
}

void InferencePublisher::run(const std::stop_token& stopped) noexcept {
  std::unique_lock lock(mutex_);
  while (wake_.wait(lock, stopped, [&] { return !waiting_.empty(); })) {  // publishes waiting requests before the end
    const Request request = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    publish(request);
    lock.lock();
  }
}

void InferencePublisher::publish(const Request& request) {
  if (model_.file_was_written()) return;
  infer_field(model_, field_, request.fit.view(), inferred_);
  message_.sequence = request.sequence;
  message_.session = request.session;
  message_.frame_id = request.frame_id;
  message_.stamp_ns = request.stamp_ns;
  message_.values = inferred_.mean;
  message_.spread = inferred_.spread;
  message_.bound_90 = inferred_.bound_90;
  sink_.send(encoder_.inference(message_));
}

}  // namespace lbea::tool
