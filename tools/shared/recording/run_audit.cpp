#include "tools/shared/recording/run_audit.hpp"

#include "adapters/mcap/recorder_account.hpp"
#include "tools/shared/recording/run_senders.hpp"
#include "tools/shared/recording/run_tally.hpp"
#include "tools/shared/recording/topics.hpp"

#include <algorithm>
#include <charconv>

namespace lbea::tool {
namespace {

constexpr std::string_view matcher_program = "lbea-serve ";

template <class Number>
Number number_in(const mcap::Texts& texts, std::string_view key) {
  Number number = 0;
  if (const auto found = texts.find(std::string(key)); found != texts.end())
    std::from_chars(found->second.data(), found->second.data() + found->second.size(), number);
  return number;
}

void read_account(RunAudit& audit, const mcap::Metadata& metadata) {
  audit.has_account = true;
  const mcap::Texts& texts = metadata.texts;
  for (const auto& [key, text] : texts)
    if (key.find("lost") != std::string::npos || key == "failed_syncs")
      audit.lost += number_in<std::uint64_t>(texts, key);
  const auto triggered = texts.find(std::string(mcap::triggered_key));
  if (triggered == texts.end()) return;
  audit.window = {triggered->second == "yes", number_in<std::int64_t>(texts, mcap::window_begin_key),
                  number_in<std::uint64_t>(texts, mcap::frames_outside_key)};
}

void read_metadata(RunAudit& audit, const std::string& file) {
  audit.is_run = audit.file.header.profile == recording_profile;
  audit.is_replayed = audit.file.header.profile == results_profile;
  for (const mcap::Metadata& metadata : audit.file.metadata) {
    if (metadata.name == settings_metadata_name) audit.settings = settings_from(metadata, file);
  }
  if (audit.is_run && !audit.settings.record_window.empty())
    audit.window.emplace(RunAudit::Window{true});  // unless its end says otherwise
  for (const mcap::Metadata& metadata : audit.file.metadata) {
    if (metadata.name == mcap::closing_metadata_name) read_account(audit, metadata);
  }
}

template <class Number>
std::uint64_t sum(const std::map<std::uint64_t, RunAudit::Session>& sessions, Number number) {
  std::uint64_t total = 0;
  for (const auto& [id, session] : sessions) total += session.*number;
  return total;
}

std::string missing_text(const RunAudit& audit) {
  const std::string text = std::to_string(audit.missing()) + " captures of the test are missing";
  if (!audit.counters) return text + ", as ids tell";
  const auto counted = [&](wire::WireStatus status) { return std::to_string(audit.counters->of(status)); };
  return text + "; the matcher says: " + counted(wire::WireStatus::missed) + " never arrived (missed), " +
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
  return file.is_intact() && lost == 0 && undecodable == 0 && (!is_run || has_account) &&
         (!window || window->triggered);
}

std::vector<std::string> RunAudit::flaws() const {
  std::vector<std::string> flaws;
  const auto say = [&](bool wrong, const std::string& what) {
    if (wrong) flaws.push_back(what);
  };
  say(!file.is_mcap, "does not begin like an MCAP file");
  say(!file.is_closed, "was cut off: it has no end and no index");
  for (const mcap::Gap& gap : file.gaps)
    say(true, "bytes " + std::to_string(gap.begin) + " to " + std::to_string(gap.end) + ": " + gap.what);
  for (const std::string& complaint : file.complaints) say(true, complaint);
  say(is_run && file.is_closed && !has_account, "the recorder's closing account is missing");
  say(window && !window->triggered, "the trigger never came: nothing was kept of what was recorded for the window, " +
                                        std::to_string(window ? window->outside : 0) + " frames");
  say(lost > 0, std::to_string(lost) + " messages were lost while recording, as the recorder says");
  if (missing() > 0) flaws.push_back(missing_text(*this));
  say(silent() > 0, std::to_string(silent()) + " senders went without goodbye: what they still held is unknown");
  say(unanswered > 0, std::to_string(unanswered) + " frames have no result");
  say(answers_alone > 0, std::to_string(answers_alone) + " results are of frames that are not there");
  say(undecodable > 0, std::to_string(undecodable) + " messages cannot be decoded");
  return flaws;
}

RunAudit audit_run(const std::filesystem::path& file) {
  RunAudit audit;
  RunTally tally(audit);
  const mcap::FileSource source(file);
  audit.file = mcap::audit(
      source, [&](const mcap::Message& message, const mcap::Channel* channel) { tally.take(message, channel); });
  read_metadata(audit, source.name());
  for (const mcap::Metadata& metadata : audit.file.metadata)
    if (metadata.name == senders_metadata_name)
      for (const wire::WireSender& sender : senders_from(metadata)) tally.know(sender);
  tally.close();
  return audit;
}

}  // namespace lbea::tool
