#include "tools/send/playlist.hpp"

#include "adapters/clouds/point_cloud.hpp"
#include "adapters/wire/codec/codec.hpp"

#include <map>

namespace lbea::tool {

namespace fs = std::filesystem;

namespace {

/// The tables of capture times, each read once.
class StampTables {
 public:
  explicit StampTables(fs::path given) : given_(std::move(given)) {}

  std::optional<std::int64_t> of(const fs::path& file, std::optional<std::int64_t> in_file) {
    const fs::path table = given_.empty() ? file.parent_path() / io::stamp_table_name : given_;
    if (given_.empty() && !fs::exists(table)) return io::CloudStamps().of(file, in_file);
    return tables_.try_emplace(table, table).first->second.of(file, in_file);
  }

 private:
  fs::path given_;
  std::map<fs::path, io::CloudStamps> tables_;
};

}  // namespace

std::vector<EncodedCloud> encode_clouds(const std::vector<fs::path>& files, const fs::path& stamps,
                                        const std::string& columns, std::uint64_t session, const std::string& frame_id,
                                        const std::function<void(std::size_t)>& progress) {
  std::vector<EncodedCloud> clouds;
  wire::Encoder encoder;
  StampTables tables(stamps);
  for (const fs::path& file : files) {
    io::PointCloud cloud = io::read_point_cloud(file, columns);
    cloud.stamp_ns = tables.of(file, cloud.stamp_ns);
    const auto message = encoder.frame({0, cloud.stamp_ns.value_or(0), cloud.points}, session, frame_id);
    if (message.empty())
      throw Error{Status::bad_input, file.string() +
                                         ": its stamp is before 1970 or after 2106, or it is larger than the 2 GB of a "
                                         "message; it cannot be sent"};
    clouds.push_back({file, std::make_shared<std::vector<std::byte>>(message.begin(), message.end()), cloud.stamp_ns});
    progress(clouds.size());
  }
  return clouds;
}

std::vector<std::int64_t> schedule_by_stamps(const std::vector<EncodedCloud>& clouds) {
  std::vector<std::int64_t> due;
  for (const EncodedCloud& cloud : clouds) {
    if (!cloud.stamp_ns)
      throw Error{Status::bad_input,
                  cloud.file.string() + ": has no stamp to pace by; use --rate instead of --realtime"};
    due.push_back(*cloud.stamp_ns - *clouds.front().stamp_ns);
    if (due.size() > 1 && due.back() < due[due.size() - 2])
      throw Error{Status::bad_input, cloud.file.string() +
                                         ": its stamp is before that of the cloud sent before it; give the files in "
                                         "the order of their stamps, or use --rate"};
  }
  const auto intervals = static_cast<std::int64_t>(due.size()) - 1;
  due.push_back(intervals > 0 ? due.back() + due.back() / intervals : 0);
  return due;
}

std::vector<std::int64_t> schedule_by_rate(std::size_t clouds, double rate_hz) {
  std::vector<std::int64_t> due;
  for (std::size_t i = 0; i <= clouds; ++i)
    due.push_back(static_cast<std::int64_t>(1e9 * static_cast<double>(i) / rate_hz));
  return due;
}

}  // namespace lbea::tool
