#include "tools/shared/recording/run_senders.hpp"

#include <array>
#include <sstream>

namespace lbea::tool {
namespace {

constexpr std::array<std::string_view, 3> condition_names{"active", "ended", "silent"};

bool read(std::istream& in, wire::SenderCondition& condition) {
  std::string name;
  in >> name;
  for (std::size_t i = 0; i < condition_names.size(); ++i) {
    if (name != condition_names[i]) continue;
    condition = static_cast<wire::SenderCondition>(i);
    return true;
  }
  return false;
}

}  // namespace

mcap::Metadata to_metadata(const std::vector<wire::WireSender>& senders) {
  mcap::Metadata metadata{std::string(senders_metadata_name), {}};
  for (const wire::WireSender& sender : senders) {
    std::ostringstream key, text;
    key << std::hex << sender.session;
    text << sender.first_id << ' ' << sender.next_id << ' ' << sender.received << ' ' << sender.missed << ' '
         << sender.withheld << ' ' << condition_names[static_cast<std::size_t>(sender.condition)];
    metadata.texts[key.str()] = text.str();
  }
  return metadata;
}

std::vector<wire::WireSender> senders_from(const mcap::Metadata& metadata) {
  std::vector<wire::WireSender> senders;
  for (const auto& [session, account] : metadata.texts) {
    wire::WireSender sender;
    std::istringstream key(session), text(account);
    const bool is_read =
        key >> std::hex >> sender.session &&
        text >> sender.first_id >> sender.next_id >> sender.received >> sender.missed >> sender.withheld &&
        read(text, sender.condition);
    if (is_read && sender.first_id <= sender.next_id) senders.push_back(sender);
  }
  return senders;
}

}  // namespace lbea::tool
