#include "adapters/mcap/repeated_definitions.hpp"

namespace lbea::mcap {

RepeatedDefinitions::RepeatedDefinitions(const RecordingStart& start, std::chrono::milliseconds interval)
    : interval_(interval) {
  for (const mcap::Schema& schema : start.schemas) definitions_.schemas.emplace(schema.id, schema);
  for (const mcap::Channel& channel : start.channels) definitions_.channels.emplace(channel.id, channel);
}

void RepeatedDefinitions::take(const mcap::Record& record) {
  static_cast<void>(definitions_.take(record));
  changed_ = true;
}

void RepeatedDefinitions::append_when_due(mcap::Buffer& front, bool has_messages) {
  const auto now = Clock::now();
  if (!changed_ && !(has_messages && now >= due_)) return;
  due_ = now + interval_;
  for (const auto& [id, schema] : definitions_.schemas) mcap::append(front, schema);
  for (const auto& [id, channel] : definitions_.channels) mcap::append(front, channel);
}

}  // namespace lbea::mcap
