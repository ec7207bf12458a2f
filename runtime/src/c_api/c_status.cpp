#include "runtime/src/c_api/c_support.hpp"

#include <iterator>

namespace lbea {
namespace {
thread_local std::array<char, 1'024> sentence_of_last_error{};

// By Status. The ones after bad_config are errors of the programs, which the runtime does not return.
constexpr lbea_status c_statuses[] = {
    LBEA_OK,          LBEA_EMPTY_FRAME,         LBEA_TOO_MANY_POINTS, LBEA_LOW_COVERAGE, LBEA_FILE_NOT_FOUND,
    LBEA_NOT_A_MODEL, LBEA_UNSUPPORTED_VERSION, LBEA_CORRUPT_MODEL,   LBEA_BAD_CONFIG};
static_assert(std::size(c_statuses) == static_cast<std::size_t>(Status::bad_config) + 1);
}  // namespace

const char* last_error() noexcept { return sentence_of_last_error.data(); }

lbea_status failed(lbea_status status, std::string_view sentence) noexcept {
  const std::size_t length = std::min(sentence.size(), sentence_of_last_error.size() - 1);
  *std::copy_n(sentence.data(), length, sentence_of_last_error.begin()) = '\0';
  return status;
}

lbea_status to_c(Status status) noexcept {
  const auto i = static_cast<std::size_t>(status);
  return i < std::size(c_statuses) ? c_statuses[i] : LBEA_INTERNAL_ERROR;
}
}  // namespace lbea

const char* lbea_status_string(lbea_status status) {
  const auto* found = std::ranges::find(lbea::c_statuses, status);
  if (found != std::end(lbea::c_statuses))
    return lbea::to_string(static_cast<lbea::Status>(found - lbea::c_statuses)).data();
  if (status == LBEA_BAD_ARGUMENT) return "bad_argument";
  if (status == LBEA_OUT_OF_MEMORY) return "out_of_memory";
  return status == LBEA_INTERNAL_ERROR ? "internal_error" : "unknown_status";
}

const char* lbea_last_error(void) { return lbea::last_error(); }
uint32_t lbea_version(void) { return LBEA_VERSION; }
const char* lbea_build_info(void) { return "lbea " LBEA_VERSION_STRING " " LBEA_BUILD_INFO; }
