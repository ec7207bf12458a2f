#include "adapters/export/mme.hpp"

#include "adapters/files/atomic_file.hpp"
#include "adapters/files/atomic_folder.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <string_view>

namespace lbea::io {
namespace {

constexpr const char* no_value = "NOVALUE";

std::string padded(const char* pattern, std::size_t number) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), pattern, number);
  return text.data();
}

/// Whether the two or three bytes at `at` end a line, or control something: U+0080 to U+009F, U+2028, U+2029.
std::size_t control_length(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u; };
  if (byte(at) < 0x20 || byte(at) == 0x7f) return 1;
  if (byte(at) == 0xc2 && byte(at + 1) >= 0x80 && byte(at + 1) < 0xa0) return 2;
  return byte(at) == 0xe2 && byte(at + 1) == 0x80 && (byte(at + 2) == 0xa8 || byte(at + 2) == 0xa9) ? 3 : 0;
}

/// One line without spaces around it; NOVALUE for nothing.
std::string line_of(std::string_view text) {
  std::string line;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t control = control_length(text, at);
    line += control > 0 ? ' ' : text[at];
    at += std::max<std::size_t>(control, 1);
  }
  const std::size_t begin = line.find_first_not_of(' '), end = line.find_last_not_of(' ');
  return begin == line.npos ? no_value : line.substr(begin, end - begin + 1);
}

template <class... Precision>
std::string number(double value, Precision... precision) {
  if (!std::isfinite(value)) return no_value;
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value, precision...).ptr;
  return {digits.data(), end};
}

/// As many as a float has.
std::string value_text(double value) { return number(value, std::chars_format::general, 9); }

class Header {
 public:
  void add(std::string_view name, std::string_view value) {
    constexpr std::size_t width = 28;  // of the names
    std::string line = line_of(name);
    line.resize(std::max(width, line.size()), ' ');
    text_ += line + ":" + line_of(value) + "\n";
  }
  [[nodiscard]] std::string& text() noexcept { return text_; }

 private:
  std::string text_;
};

/// The first extreme value and its time.
void add_extreme(Header& header, const MmeChannel& channel, const char* name, double sign) {
  std::size_t place = channel.values.size();
  for (std::size_t i = 0; i < channel.values.size(); ++i)
    if (std::isfinite(channel.values[i]) &&
        (place == channel.values.size() || sign * channel.values[i] > sign * channel.values[place]))
      place = i;
  const bool is_known = place < channel.values.size();
  header.add("First global " + std::string(name) + " value", is_known ? value_text(channel.values[place]) : no_value);
  header.add("Time of " + std::string(name) + " value",
             is_known ? value_text(channel.first_s + static_cast<double>(place) * channel.interval_s) : no_value);
}

std::string channel_file(const MmeChannel& channel) {
  Header header;
  header.add("Test object number", "0");
  header.add("Name of the channel", channel.name);
  header.add("Laboratory channel code", "");
  header.add("Customer channel code", "");
  header.add("Channel code", channel.code.text());
  header.add("Unit", channel.unit);
  header.add("Reference channel", "implicit");
  header.add("Reference channel name", "");
  header.add("Data source", channel.source);
  header.add("Data status", "ok");
  header.add("Dimension", channel.code.dimension);
  header.add("Direction", std::string(1, channel.code.direction));
  header.add("Channel frequency class", channel.cfc > 0 ? std::to_string(channel.cfc) : "");
  header.add("Sampling interval", number(channel.interval_s));
  header.add("Time of first sample", number(channel.first_s));
  header.add("Number of samples", std::to_string(channel.values.size()));
  add_extreme(header, channel, "maximum", 1);
  add_extreme(header, channel, "minimum", -1);
  for (const double value : channel.values) header.text() += value_text(value) + "\n";
  return std::move(header.text());
}

std::string test_file(const MmeTest& test, const std::string& name) {
  Header header;
  header.add("Data format edition number", "1.6");
  header.add("Laboratory name", "");
  header.add("Customer name", "");
  header.add("Customer test ref. number", name);
  header.add("Number of test objects", "1");
  header.add("Name of test object 1", "");
  for (const auto& [fact, value] : test.facts) header.add(fact, value);
  return std::move(header.text());
}

std::string channel_list(const MmeTest& test) {
  Header header;
  header.add("Instrumentation standard", "");
  header.add("Number of channels", std::to_string(test.channels.size()));
  for (std::size_t i = 0; i < test.channels.size(); ++i)
    header.add("Name of channel " + padded("%03zu", i + 1),
               test.channels[i].code.text() + " / " + line_of(test.channels[i].name));
  return std::move(header.text());
}

}  // namespace

std::string MmeCode::text() const {
  return "000000" + padded("%04zu", number) + "00" + dimension + std::string{direction, filter};
}

char mme_filter(std::uint32_t cfc) noexcept {
  constexpr std::array<std::pair<std::uint32_t, char>, 5> letters{
      {{0, '0'}, {1000, 'A'}, {600, 'B'}, {180, 'C'}, {60, 'D'}}};
  const auto found = std::ranges::find(letters, cfc, &std::pair<std::uint32_t, char>::first);
  return found == letters.end() ? 'S' : found->second;
}

void write_mme(const std::filesystem::path& folder, const MmeTest& test, const std::function<void()>& check) {
  AtomicFolder pending(folder);
  const std::string name = pending.path().filename().string();
  const std::filesystem::path channels = pending.path() / "Channel";
  std::error_code error;
  if (!std::filesystem::create_directory(channels, error))
    throw Error(Status::write_failed, folder.string() + ": cannot be written: " + error.message());
  for (std::size_t i = 0; i < test.channels.size(); ++i) {
    check();
    write_file(channels / (name + padded(".%03zu", i + 1)), channel_file(test.channels[i]));
  }
  write_file(channels / (name + ".chn"), channel_list(test));
  write_file(pending.path() / (name + ".mme"), test_file(test, name));
  check();
  pending.commit();
}

}  // namespace lbea::io
