#include "tools/serve/pipeline/inference_publisher.hpp"

#include <algorithm>

namespace lbea::tool {
namespace {

constexpr int inferences_held = 100;      // per subscriber
constexpr std::size_t max_waiting = 256;  // of each component; a quarter of a second at 1,000 frames a second

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
                                       const wire::ServerAccess& access, std::vector<InferredField> fields)
    : fields_(std::move(fields)), sink_(context, endpoint, inferences_held * static_cast<int>(fields_.size()), access) {
  for (const auto& [component, model, field] : fields_) {
    const FieldInfo info = model.field(field);
    messages_.push_back({.field = std::string(info.name),
                         .unit = std::string(info.unit),
                         .location = info.location,
                         .model_checksum = model.checksum(),
                         .component = component});
  }
  thread_ = std::jthread([this](const std::stop_token& stopped) { run(stopped); });
}

void InferencePublisher::result(wire::Message, const wire::WireResult& result) noexcept {
  if (result.fit.estimate.empty()) return;
  const auto of = std::ranges::find(fields_, result.component, &InferredField::component);
  if (of == fields_.end()) return;
  const auto component = static_cast<std::size_t>(of - fields_.begin());
  const std::lock_guard lock(mutex_);
  if (waiting_.size() == max_waiting * fields_.size()) waiting_.pop_front();
  waiting_.push_back({++requested_, result.session, result.frame_id, result.stamp_ns, component, result.fit});
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
  const InferredField& of = fields_[request.component];
  if (of.model.file_was_written()) return;
  infer_field(of.model, of.field, request.fit.view(), inferred_);
  wire::WireInference& message = messages_[request.component];
  message.sequence = request.sequence;
  message.session = request.session;
  message.frame_id = request.frame_id;
  message.stamp_ns = request.stamp_ns;
  message.values = inferred_.mean;
  message.spread = inferred_.spread;
  message.bound_90 = inferred_.bound_90;
  sink_.send(encoder_.inference(message));
}

}  // namespace lbea::tool
