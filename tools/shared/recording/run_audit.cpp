#include "tools/shared/recording/run_audit.hpp"

#include <algorithm>

namespace lbea::tool {
namespace {

constexpr std::string_view matcher_program = "lbea-serve ";

template <class Number>
std::uint64_t sum(const std::map<std::uint64_t, RunAudit::Session>& sessions, Number number) {
  std::uint64_t total = 0;
  for (const auto& [id, session] : sessions) total += session.*number;
  return total;
}

std::string missing_text(const RunAudit& audit) {
  const std::string text = std::to_string(audit.missing()) + " captures of the test are missing";
  if (!audit.counters) return text + ", according to the ids";
  const auto counted = [&](wire::WireStatus status) { return std::to_string(audit.counters->of(status)); };
  return text + "; the matcher reports: " + counted(wire::WireStatus::missed) + " never arrived (missed), " +
         counted(wire::WireStatus::withheld) + " found no room at the sender (withheld)";
}

}  // namespace

bool RunAudit::is_matchers_own() const noexcept {
  return is_run && !window && settings.program.starts_with(matcher_program);
}

std::uint64_t RunAudit::missing() const noexcept {
  const std::uint64_t by_ids = sum(sessions, &Session::missing);
  if (!is_matchers_own() || !counters) return by_ids;
  return std::max(by_ids, counters->of(wire::WireStatus::missed) + counters->of(wire::WireStatus::withheld));
}

std::uint64_t RunAudit::silent() const noexcept {
  if (is_matchers_own()) return counters ? counters->silent : 0;
  return static_cast<std::uint64_t>(
      std::ranges::count_if(sessions, [](const auto& session) { return session.second.silent; }));
}

std::uint64_t RunAudit::duplicates() const noexcept { return sum(sessions, &Session::duplicates); }

bool RunAudit::holds_all_that_came() const noexcept {
  return file.is_intact() && lost == 0 && undecodable == 0 && (!is_run || has_closing_metadata) &&
         (!window || window->triggered);
}

std::vector<std::string> RunAudit::flaws() const {
  std::vector<std::string> flaws;
  const auto add = [&](bool wrong, const std::string& what) {
    if (wrong) flaws.push_back(what);
  };
  add(!file.is_mcap, "is not an MCAP file");
  add(!file.is_closed, "was cut off: it has no end and no index");
  for (const mcap::Gap& gap : file.gaps)
    add(true, "bytes " + std::to_string(gap.begin) + " to " + std::to_string(gap.end) + ": " + gap.what);
  for (const std::string& error : file.errors) add(true, error);
  add(is_run && file.is_closed && !has_closing_metadata, "the recorder's closing metadata are missing");
  add(window && !window->triggered, "there was no trigger: nothing was recorded for the window, of " +
                                        std::to_string(window ? window->outside : 0) + " frames");
  add(lost > 0, std::to_string(lost) + " messages were lost while recording, as the recorder reports");
  if (missing() > 0) flaws.push_back(missing_text(*this));
  add(silent() > 0,
      std::to_string(silent()) + " senders did not say goodbye: how many captures followed or were held is unknown");
  add(interleaved > 0, "the frames of different senders alternate (" + std::to_string(interleaved) +
                           " returns to an earlier one): they are not one test");
  add(unanswered > 0, std::to_string(unanswered) + " frames have no result");
  add(answers_alone > 0, std::to_string(answers_alone) + " results have no frame");
  add(undecodable > 0, std::to_string(undecodable) + " messages cannot be decoded");
  return flaws;
}

}  // namespace lbea::tool
