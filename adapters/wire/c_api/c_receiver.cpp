// The C interface to receivers of results: opening, receiving, what the matcher reports.
#include "adapters/wire/c_api/c_receiver.hpp"

using namespace lbea;
using namespace lbea::wire;

namespace lbea::wire {
namespace {
using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds look_interval{50};

constexpr std::size_t least_account = offsetof(lbea_wire_account, damaged) + sizeof(std::uint64_t);
constexpr std::size_t least_receipt = offsetof(lbea_wire_receipt, withheld) + sizeof(std::uint64_t);
constexpr std::size_t least_matcher = offsetof(lbea_wire_matcher, samples) + sizeof(std::uint32_t);

lbea_wire_status unknown(std::string_view sentence) noexcept { return failed(LBEA_WIRE_UNKNOWN, sentence); }

/// Why no result arrived.
lbea_wire_status without_result(lbea_wire_receiver& r, std::uint32_t timeout_ms) {
  const Link link = r.results.link();
  if (link == Link::admitted)
    return failed(LBEA_WIRE_TIMEOUT, "endpoint \"" + r.endpoint + "\": no result within " + std::to_string(timeout_ms) +
                                         " ms; check that frames are sent");
  return not_connected(link, r.endpoint, "--results");
}

/// Whether the matcher has answered within `patience`. A result that comes first is kept.
bool wait_answer(lbea_wire_receiver& r, std::chrono::milliseconds patience) {
  const auto deadline = Clock::now() + patience;
  while (r.results.state() == nullptr) {
    r.pending = r.results.receive(std::min(patience, look_interval));
    if (r.pending != nullptr) break;
    if (r.results.link() == Link::refused || Clock::now() >= deadline) return r.results.state() != nullptr;
  }
  return true;
}

/// Of the latest message.
const Counters& latest_counters(const lbea_wire_receiver& r) noexcept {
  return r.latest == nullptr || r.results.ends_with_state() ? r.results.state()->counters : r.latest->counters;
}
}  // namespace
}  // namespace lbea::wire

lbea_wire_status lbea_wire_receiver_open(const char* endpoint, const lbea_wire_options* options,
                                         lbea_wire_receiver** receiver) {
  if (receiver == nullptr)
    return bad_argument("lbea_wire_receiver_open: receiver is NULL; give the address of a pointer");
  *receiver = nullptr;
  if (endpoint == nullptr) return bad_argument("lbea_wire_receiver_open: endpoint is NULL; give that of --results");
  if (!has_known_size(options)) return bad_argument(size_not_set);
  return guarded([&] {
    refuse_own_process(endpoint);
    const OpenOptions given = read_options(options, results_held);
    auto opened = std::make_unique<lbea_wire_receiver>(endpoint, given);
    if (!wait_answer(*opened, given.patience))
      return not_connected(opened->results.link(), opened->endpoint, "--results");
    opened->latest = opened->pending;
    *receiver = opened.release();
    return LBEA_WIRE_OK;
  });
}

void lbea_wire_receiver_close(lbea_wire_receiver* receiver) { delete receiver; }

lbea_wire_status lbea_wire_receiver_receive(lbea_wire_receiver* receiver, uint32_t timeout_ms,
                                            lbea_wire_result* result) {
  if (receiver == nullptr || result == nullptr)
    return bad_argument("lbea_wire_receiver_receive: receiver or result is NULL");
  if (!is_plausible_size(result->struct_size, least_wire_result)) return bad_argument(size_not_set);
  return guarded([&] {
    const WireResult* received = std::exchange(receiver->pending, nullptr);
    if (received == nullptr) received = receiver->results.receive(to_ms(timeout_ms));
    if (received == nullptr) {
      write_c_struct(lbea_wire_result{}, result);
      return without_result(*receiver, timeout_ms);
    }
    receiver->latest = received;
    write_c_struct(receiver->to_c(*received), result);
    return received->status == WireStatus::end_of_stream ? LBEA_WIRE_END_OF_TEST : LBEA_WIRE_OK;
  });
}

lbea_wire_status lbea_wire_receiver_get_account(const lbea_wire_receiver* receiver, lbea_wire_account* account) {
  if (receiver == nullptr || account == nullptr)
    return bad_argument("lbea_wire_receiver_get_account: receiver or account is NULL");
  const Counters& counters = latest_counters(*receiver);
  const lbea_wire_account found{.struct_size = 0,
                                .sessions = static_cast<std::uint32_t>(counters.sessions),
                                .captured = counters.captured(),
                                .matched = counters.sum(Fate::matched),
                                .rejected = counters.sum(Fate::rejected),
                                .dropped = counters.sum(Fate::dropped),
                                .on_the_way = counters.on_the_way(),
                                .missed = counters.of(WireStatus::missed),
                                .withheld = counters.of(WireStatus::withheld),
                                .unannounced = counters.unannounced,
                                .unrecorded = counters.unrecorded,
                                .lost = receiver->results.lost(),
                                .damaged = receiver->results.damaged()};
  return write_out(found, account, least_account);
}

lbea_wire_status lbea_wire_receiver_get_receipt(const lbea_wire_receiver* receiver, uint64_t session,
                                                lbea_wire_receipt* receipt) {
  if (receiver == nullptr || receipt == nullptr)
    return bad_argument("lbea_wire_receiver_get_receipt: receiver or receipt is NULL");
  const WireState* state = receiver->results.state();
  if (state == nullptr) return unknown("the matcher has not published its state yet; receive again");
  const auto found = std::ranges::find(state->senders, session, &WireSender::session);
  if (found == state->senders.end())
    return unknown("the matcher's latest state lists no sender with this session; receive again");
  return write_out({.struct_size = 0,
                    .has_ended = found->condition == SenderCondition::ended,
                    .is_silent = found->condition == SenderCondition::silent,
                    .captured = found->next_id - found->first_id,
                    .received = found->received,
                    .missed = found->missed,
                    .withheld = found->withheld},
                   receipt, least_receipt);
}

lbea_wire_status lbea_wire_receiver_get_matcher(const lbea_wire_receiver* receiver, lbea_wire_matcher* matcher) {
  if (receiver == nullptr || matcher == nullptr)
    return bad_argument("lbea_wire_receiver_get_matcher: receiver or matcher is NULL");
  const WireState* state = receiver->results.state();
  if (state == nullptr) return unknown("the matcher has not published its state yet; receive again");
  return write_out({.struct_size = 0,
                    .max_points = state->max_points,
                    .version = state->version.c_str(),
                    .method = state->method.c_str(),
                    .model_file = state->model.file.c_str(),
                    .length_unit = state->model.length_unit.c_str(),
                    .model_checksum = state->model.checksum,
                    .simulations = static_cast<std::uint32_t>(state->model.simulations.size()),
                    .samples = state->model.samples},
                   matcher, least_matcher);
}

const char* lbea_wire_receiver_simulation_name(const lbea_wire_receiver* receiver, uint32_t simulation) {
  if (receiver == nullptr) return nullptr;
  const WireState* state = receiver->results.state();
  if (state == nullptr) return nullptr;
  const auto name_in = [&](const ModelSummary& model) {
    return simulation < model.simulations.size() ? model.simulations[simulation].c_str() : nullptr;
  };
  if (receiver->latest == nullptr || receiver->latest->model_checksum == state->model.checksum)
    return name_in(state->model);
  for (const WireComponent& component : state->components)
    if (component.name == receiver->latest->component && component.model.checksum == receiver->latest->model_checksum)
      return name_in(component.model);
  return nullptr;
}
