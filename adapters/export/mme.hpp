// Signals of one test in the format of ISO/TS 13499 (ISO-MME): a folder with NAME.mme, Channel/NAME.chn and
// Channel/NAME.001, NAME.002, ...
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace lbea::io {

/// What a channel code says.
struct MmeCode {
  std::uint32_t number = 0;  // fine locations 1 and 2, at most 9999
  std::string dimension;     // of two letters: "DS", "VE", "AC", "DC"
  char direction = '0';      // X, Y, Z, R: resultant, 0: other
  char filter = '0';         // filter class
  /// Of 16 characters. Test object, position and main location are 0: undefined.
  [[nodiscard]] std::string text() const;
};

/// The letter of a channel frequency class of ISO 6487: 0 for none, S for one without a letter.
[[nodiscard]] char mme_filter(std::uint32_t cfc) noexcept;

/// Equidistant values. Any text; line ends and other control characters become spaces.
struct MmeChannel {
  MmeCode code;
  std::string name, unit, source;  // source: "camera", "simulation"
  std::uint32_t cfc = 0;           // 0: not filtered
  double first_s = 0, interval_s = 0;
  std::vector<double> values;  // not finite: NOVALUE
};

struct MmeTest {
  std::vector<std::pair<std::string, std::string>> facts;  // lines of NAME.mme after those that every test has
  std::vector<MmeChannel> channels;
};

/// Writes `folder`; NAME is its name. Values have 9 significant digits, times all. `check` is called before each
/// channel. Throws what it throws, and Error{write_failed}, also when the folder exists; then no folder remains.
void write_mme(
    const std::filesystem::path& folder, const MmeTest& test, const std::function<void()>& check = [] {});

}  // namespace lbea::io
