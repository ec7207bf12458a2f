// The C interface to frames and results: statuses, errors, options.
#include "adapters/wire/c_api/c_support.hpp"
#include "adapters/wire/codec/messages.hpp"
#include "adapters/wire/sockets/client.hpp"
#include "adapters/wire/sockets/endpoint.hpp"

#include <lbea/version.hpp>

#include <system_error>
#include <utility>

namespace lbea::wire {
namespace {
thread_local std::array<char, 1'024> sentence_of_last_error{};

constexpr std::uint32_t most_queued = 1'000'000;
constexpr std::size_t least_options = offsetof(lbea_wire_options, key_file) + sizeof(const char*);

constexpr std::pair<lbea_wire_status, const char*> status_names[] = {
    {LBEA_WIRE_OK, "ok"},
    {LBEA_WIRE_NO_ROOM, "no_room"},
    {LBEA_WIRE_BAD_STAMP, "bad_stamp"},
    {LBEA_WIRE_TOO_LARGE, "too_large"},
    {LBEA_WIRE_TIMEOUT, "timeout"},
    {LBEA_WIRE_END_OF_TEST, "end_of_test"},
    {LBEA_WIRE_UNKNOWN, "unknown"},
    {LBEA_WIRE_UNDELIVERED, "undelivered"},
    {LBEA_WIRE_BAD_CONFIG, "bad_config"},
    {LBEA_WIRE_UNAVAILABLE, "unavailable"},
    {LBEA_WIRE_REFUSED, "refused"},
    {LBEA_WIRE_BAD_ARGUMENT, "bad_argument"},
    {LBEA_WIRE_OUT_OF_MEMORY, "out_of_memory"},
    {LBEA_WIRE_INTERNAL_ERROR, "internal_error"},
};

/// C gives paths in UTF-8.
std::filesystem::path path_of(const char* text) {
  if (text == nullptr) return {};
  try {
    return reinterpret_cast<const char8_t*>(text);
  } catch (const std::system_error&) {  // on Windows, where paths are UTF-16
    throw Error(Status::bad_config, std::string(text) + ": this path is not UTF-8; convert it");
  }
}
}  // namespace

lbea_wire_status failed(lbea_wire_status status, std::string_view sentence) noexcept {
  const std::size_t length = std::min(sentence.size(), sentence_of_last_error.size() - 1);
  *std::copy_n(sentence.data(), length, sentence_of_last_error.begin()) = '\0';
  return status;
}

lbea_wire_status not_connected(Link link, const std::string& endpoint, const char* option) {
  return failed(link == Link::refused ? LBEA_WIRE_REFUSED : LBEA_WIRE_UNAVAILABLE, explain(link, endpoint, option));
}

lbea_wire_status to_c(Status status) noexcept {
  if (status == Status::endpoint_unavailable) return LBEA_WIRE_UNAVAILABLE;
  const bool is_setting = status == Status::bad_config || status == Status::file_not_found;
  return is_setting ? LBEA_WIRE_BAD_CONFIG : LBEA_WIRE_INTERNAL_ERROR;
}

void refuse_own_process(const std::string& endpoint) {
  if (endpoint.starts_with("inproc://"))
    refuse_endpoint(endpoint, "only threads of one process meet there; write tcp://127.0.0.1:5555");
}

bool has_known_size(const lbea_wire_options* options) noexcept {
  return options == nullptr || is_plausible_size(options->struct_size, least_options);
}

OpenOptions read_options(const lbea_wire_options* options, std::uint32_t queued_by_default) {
  lbea_wire_options full{};
  if (options != nullptr && !read_c_struct(options, full))
    throw Error(Status::bad_config, "the options set a field that this older library does not know");
  if (full.queued_messages > most_queued)
    throw Error(Status::bad_config, "queued_messages is " + std::to_string(full.queued_messages) + ", more than " +
                                        std::to_string(most_queued));
  for (const char* file : {full.server_key_file, full.key_file})
    if (file != nullptr && *file == '\0')
      throw Error(Status::bad_config,
                  "the name of a key file is empty; give the file, or NULL to connect without keys");
  if (full.key_file != nullptr && full.server_key_file == nullptr)
    throw Error(Status::bad_config, "key_file without server_key_file; give the matcher's .pub file too");
  return {.access = read_client_access(path_of(full.server_key_file), path_of(full.key_file)),
          .patience = full.patience_ms == 0 ? default_patience : to_ms(full.patience_ms),
          .queued_messages = full.queued_messages == 0 ? queued_by_default : full.queued_messages};
}
}  // namespace lbea::wire

using namespace lbea::wire;

uint32_t lbea_wire_version(void) { return (LBEA_VERSION_MAJOR << 16) | (LBEA_VERSION_MINOR << 8) | LBEA_VERSION_PATCH; }

const char* lbea_wire_status_string(lbea_wire_status status) {
  for (const auto& [known, name] : status_names)
    if (known == status) return name;
  return "unknown_status";
}

// The names are literals, which end with a zero byte.
const char* lbea_wire_frame_status_string(lbea_wire_frame_status status) {
  const bool is_byte = status >= 0 && status <= 255;
  return to_string(static_cast<WireStatus>(is_byte ? status : 255)).data();
}

const char* lbea_wire_verdict_string(lbea_wire_verdict verdict) {
  const bool is_byte = verdict >= 0 && verdict <= 255;
  return to_string(static_cast<WireVerdict>(is_byte ? verdict : 255)).data();
}

const char* lbea_wire_last_error(void) { return sentence_of_last_error.data(); }
