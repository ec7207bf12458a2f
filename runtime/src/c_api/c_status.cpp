#include "runtime/src/c_api/c_guard.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

namespace lbea {
namespace {

thread_local std::array<char, 1'024> sentence_of_last_error{};

}  // namespace

const char* last_error() noexcept { return sentence_of_last_error.data(); }

lbea_status failed(lbea_status status, std::string_view sentence) noexcept {
  const std::size_t length = std::min(sentence.size(), sentence_of_last_error.size() - 1);
  *std::copy_n(sentence.data(), length, sentence_of_last_error.begin()) = '\0';
  return status;
}

lbea_status to_c(Status status) noexcept {
  switch (status) {
    case Status::ok:
      return LBEA_OK;
    case Status::empty_frame:
      return LBEA_EMPTY_FRAME;
    case Status::too_many_points:
      return LBEA_TOO_MANY_POINTS;
    case Status::low_coverage:
      return LBEA_LOW_COVERAGE;
    case Status::file_not_found:
      return LBEA_FILE_NOT_FOUND;
    case Status::not_a_model:
      return LBEA_NOT_A_MODEL;
    case Status::unsupported_version:
      return LBEA_UNSUPPORTED_VERSION;
    case Status::corrupt_model:
      return LBEA_CORRUPT_MODEL;
    case Status::bad_config:
      return LBEA_BAD_CONFIG;
    case Status::bad_input:
    case Status::unsupported_input:
    case Status::write_failed:
    case Status::endpoint_unavailable:
      break;  // of the programs; the runtime has no such
  }
  return LBEA_INTERNAL_ERROR;
}

}  // namespace lbea

const char* lbea_status_string(lbea_status status) {
  switch (status) {
    case LBEA_OK:
      return "ok";
    case LBEA_EMPTY_FRAME:
      return "empty_frame";
    case LBEA_TOO_MANY_POINTS:
      return "too_many_points";
    case LBEA_LOW_COVERAGE:
      return "low_coverage";
    case LBEA_FILE_NOT_FOUND:
      return "file_not_found";
    case LBEA_NOT_A_MODEL:
      return "not_a_model";
    case LBEA_UNSUPPORTED_VERSION:
      return "unsupported_version";
    case LBEA_CORRUPT_MODEL:
      return "corrupt_model";
    case LBEA_BAD_CONFIG:
      return "bad_config";
    case LBEA_BAD_ARGUMENT:
      return "bad_argument";
    case LBEA_OUT_OF_MEMORY:
      return "out_of_memory";
    case LBEA_INTERNAL_ERROR:
      return "internal_error";
    case LBEA_STATUS_MAX_:
      break;
  }
  return "unknown_status";
}

const char* lbea_last_error(void) { return lbea::last_error(); }
uint32_t lbea_version(void) { return LBEA_VERSION; }
const char* lbea_build_info(void) { return "lbea " LBEA_VERSION_STRING " " LBEA_BUILD_INFO; }
