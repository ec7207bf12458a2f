// The curves of one test, for browsers that connect later: bounded, and thinned when they grow too long.
#pragma once

#include "tools/shared/answer/clock_times.hpp"
#include "tools/shared/answer/test_answer.hpp"

#include <nlohmann/json_fwd.hpp>

namespace lbea::tool {

/// The rows that a browser has read.
struct LogCursor {
  std::uint64_t epoch = 0;
  std::size_t row = 0;
};

class TestLog {
 public:
  static constexpr std::size_t chances = 8;
  /// Columns of a row. `chances` pairs of (simulation, probability) follow. NaN: unknown.
  enum Column : std::size_t {
    time_s,
    frame,
    verdict,
    status,
    simulation,
    time_step,
    distance,
    first_fit_number,
    first_frame_number = first_fit_number + fit_numbers.size(),
    final_error_90 = first_frame_number + frame_numbers.size(),  // of the forecast
    x,
    y,
    z,
    latency_ms,
    column_count
  };
  static constexpr std::size_t row_values = column_count + 2 * chances;
  using Row = std::array<float, row_values>;
  static constexpr std::size_t default_capacity = 8192;
  /// Of all channels together: with more than 64 channels a log holds fewer rows.
  static constexpr std::size_t most_channel_values = std::size_t{1} << 19;

  struct Channel {
    std::string name, unit;
  };

  /// capacity: rows.
  explicit TestLog(std::size_t capacity = default_capacity) : capacity_(capacity) {}

  /// Adds a result. The first matched frame of another sender, or after the end of the stream, clears the log before.
  void add(const wire::WireResult& result);

  [[nodiscard]] std::uint64_t epoch() const noexcept {
    return epoch_;
  }  // increases when rows change that may have been read
  [[nodiscard]] std::size_t every() const noexcept { return every_; }  // results per row
  [[nodiscard]] std::span<const Row> rows() const noexcept { return rows_; }
  /// Frame ids of the rows, whose floats do not hold large ones.
  [[nodiscard]] std::span<const std::uint64_t> ids() const noexcept { return ids_; }
  /// The quantities of interest of the first frame of the test that has some.
  [[nodiscard]] std::span<const Channel> channels() const noexcept { return channels_; }
  /// rows x channels. Unknown in doubtful frames.
  [[nodiscard]] std::span<const ChannelValue> channel_values() const noexcept { return channel_values_; }
  [[nodiscard]] bool is_complete() const noexcept { return complete_; }
  [[nodiscard]] std::uint64_t results() const noexcept { return results_; }
  [[nodiscard]] std::uint64_t session() const noexcept { return session_; }
  [[nodiscard]] const TestAnswer& answer() const noexcept { return answer_; }
  [[nodiscard]] double seconds(std::int64_t stamp_ns) const noexcept {
    return difference_ns(stamp_ns, first_stamp_ns_) * 1e-9;
  }

 private:
  void begin(const wire::WireResult& first);
  void name_channels(const wire::WireResult& result);
  void add_channel_values(const wire::WireResult& result);
  void thin();
  [[nodiscard]] std::size_t most_rows() const noexcept;
  std::size_t capacity_;
  std::uint64_t epoch_ = 1, session_ = 0, results_ = 0;
  std::size_t every_ = 1;
  std::int64_t first_stamp_ns_ = 0;
  bool complete_ = false, started_ = false;
  TestAnswer answer_;
  std::vector<Row> rows_;
  std::vector<std::uint64_t> ids_;
  std::vector<Channel> channels_;
  std::vector<ChannelValue> channel_values_;
};

/// Of each component; empty before the first rows are read.
using LogCursors = std::vector<LogCursor>;

/// The names of the columns before the chances.
[[nodiscard]] std::vector<std::string> column_names();

/// A packet with at most `most` rows after the cursor, which moves; empty when there are none. Sections: "rows": rows x
/// row_values; "channels": rows x channels x 2 (value, 90 % bound). The first packet of an epoch names the channels.
[[nodiscard]] std::string next_rows(const TestLog& log, LogCursor& cursor, std::size_t most);

/// The same of the logs of several components in one packet, each as its section "component0", ...
[[nodiscard]] std::string next_rows(std::span<const TestLog> logs, LogCursors& cursors, std::size_t most);

/// The test as the page reads it; `stamp_ns`: of the shown frame. "answer" is null before the test has a state.
[[nodiscard]] nlohmann::json to_json(const TestLog& log, std::int64_t stamp_ns,
                                     std::span<const std::string> simulation_names);

/// With one header line, the names of simulations instead of their numbers, and the channels last.
[[nodiscard]] std::string to_csv(const TestLog& log, std::span<const std::string> simulation_names);

}  // namespace lbea::tool
