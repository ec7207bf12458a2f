// A recording: its frames one by one, and the curves of its tests.
#pragma once

#include "tools/monitor/feeds/feed.hpp"
#include "tools/shared/matching/named_models.hpp"

namespace lbea::tool {

class RecordingFeed : public Feed {
 public:
  [[nodiscard]] virtual std::size_t frames() const noexcept = 0;
};

/// Reads the whole file once. Throws Error{file_not_found | bad_input}.
[[nodiscard]] std::unique_ptr<RecordingFeed> make_recording_feed(const std::filesystem::path& file,
                                                                 const std::vector<NamedModel>& models);

}  // namespace lbea::tool
