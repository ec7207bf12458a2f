// Log lines about who came to the endpoints and who was turned away: one a second at most for strangers, however many.
#pragma once

#include "tools/serve/pipeline.hpp"

#include <chrono>

namespace lbea::tool {

class PeerLog {
 public:
  explicit PeerLog(Pipeline& pipeline) : pipeline_(pipeline) {}
  /// To be called often.
  void look(std::chrono::steady_clock::time_point now);

 private:
  void tell(const char* endpoint, const std::vector<wire::PeerVisit>& visits, const wire::PeerCounts& counts,
            wire::PeerCounts& told);

  Pipeline& pipeline_;
  std::chrono::steady_clock::time_point next_{};
  wire::PeerCounts frames_told_, results_told_;
};

}  // namespace lbea::tool
