#include "tools/record/waiting_words.hpp"

#include <algorithm>

namespace lbea::tool {

void WaitingWords::add(const SenderWord& word) {
  if (SenderWord* last = word.ends_stream ? nullptr : replaceable_by(word.control)) {
    *last = word;
    return;
  }
  if (words_.size() == most) words_.pop_front();
  words_.push_back(word);
}

/// The session's last word, if it is not its first and says nothing that the later one does not say too.
SenderWord* WaitingWords::replaceable_by(const wire::Control& later) {
  const auto is_of_session = [&](const SenderWord& word) { return word.control.session == later.session; };
  const auto last = std::find_if(words_.rbegin(), words_.rend(), is_of_session);
  if (last == words_.rend() || std::find_if(last + 1, words_.rend(), is_of_session) == words_.rend()) return nullptr;
  const wire::Control& earlier = last->control;
  const bool is_contained = earlier.withheld == 0 && later.next_id - later.withheld >= earlier.next_id;
  return is_contained && !last->ends_stream ? &*last : nullptr;
}

}  // namespace lbea::tool
