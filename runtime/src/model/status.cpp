#include <lbea/lbea.hpp>

namespace lbea {

std::string_view to_string(Status status) noexcept {
  switch (status) {
    case Status::ok:
      return "ok";
    case Status::empty_frame:
      return "empty_frame";
    case Status::too_many_points:
      return "too_many_points";
    case Status::low_coverage:
      return "low_coverage";
    case Status::file_not_found:
      return "file_not_found";
    case Status::not_a_model:
      return "not_a_model";
    case Status::unsupported_version:
      return "unsupported_version";
    case Status::corrupt_model:
      return "corrupt_model";
    case Status::bad_config:
      return "bad_config";
    case Status::bad_input:
      return "bad_input";
    case Status::unsupported_input:
      return "unsupported_input";
    case Status::write_failed:
      return "write_failed";
    case Status::endpoint_unavailable:
      return "endpoint_unavailable";
  }
  return "unknown_status";
}

std::string_view to_string(Verdict verdict) noexcept {
  switch (verdict) {
    case Verdict::unknown:
      return "unknown";
    case Verdict::matched:
      return "matched";
    case Verdict::ambiguous:
      return "ambiguous";
    case Verdict::no_simulation_fits:
      return "no_simulation_fits";
  }
  return "unknown";
}

}  // namespace lbea
