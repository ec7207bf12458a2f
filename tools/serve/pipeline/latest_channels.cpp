#include "tools/serve/pipeline/latest_channels.hpp"

#include "tools/shared/answer/doubtful.hpp"

namespace lbea::tool {

void LatestChannels::add(const wire::WireResult& result) {
  const bool is_matched = wire::fate_of(result.status) == wire::Fate::matched;
  const std::lock_guard lock(mutex_);
  if (!is_matched && (result.status != wire::WireStatus::end_of_stream || result.session != latest_.session)) return;
  latest_.session = result.session;
  if (is_doubtful(result))
    latest_.channels.clear();
  else
    latest_.channels = result.channels;
}

LatestChannels::Frame LatestChannels::load() const {
  const std::lock_guard lock(mutex_);
  return latest_;
}

}  // namespace lbea::tool
