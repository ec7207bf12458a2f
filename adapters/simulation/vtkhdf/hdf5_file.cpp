#include "adapters/simulation/vtkhdf/hdf5_file.hpp"

#include "adapters/files/binary_numbers.hpp"

#include <hdf5.h>

#include <algorithm>
#include <array>
#include <utility>

namespace lbea::io::hdf5 {
namespace {
static_assert(sizeof(hid_t) == sizeof(std::int64_t));

constexpr std::uint64_t densest = 1100;  // deflate does not reach this ratio, so a larger one means damage
constexpr std::size_t longest_text = 256, most_names = 10'000;

/// Keeps libhdf5 from printing its errors in this thread.
class Quiet {
 public:
  Quiet() noexcept {
    H5Eget_auto2(H5E_DEFAULT, &function_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~Quiet() { H5Eset_auto2(H5E_DEFAULT, function_, data_); }
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

 private:
  H5E_auto2_t function_ = nullptr;
  void* data_ = nullptr;
};

class Handle {
 public:
  Handle(hid_t id, herr_t (*close)(hid_t)) noexcept : id_(id), close_(close) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  ~Handle() {
    if (id_ >= 0) close_(id_);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  Handle& operator=(Handle&&) = delete;
  operator hid_t() const noexcept { return id_; }
  [[nodiscard]] bool is_open() const noexcept { return id_ >= 0; }

 private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

bool is_number(const Handle& type) {
  const H5T_class_t kind = H5Tget_class(type);
  const std::size_t size = H5Tget_size(type);
  return (kind == H5T_INTEGER || kind == H5T_FLOAT) && size >= 1 && size <= 8;
}
}  // namespace

struct File::Dataset {
  Handle id, type, space;
  Shape shape;
  std::size_t dimensions = 0;
};

File::File(const std::filesystem::path& path) : input_(path) {
  // At the exit of a program libhdf5 would close what a damaged file kept it from closing, and print that it cannot.
  static const herr_t is_left_open = H5dont_atexit();
  static_cast<void>(is_left_open);
  const Quiet quiet;
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_fclose_degree(access, H5F_CLOSE_STRONG);
  H5Pset_file_locking(access, false, true);  // folders of runs may be read-only, or on file systems without locks
  file_ = H5Fopen(path.c_str(), H5F_ACC_RDONLY, access);
  if (file_ < 0) fail("cannot be opened; it is damaged or cut short, export it again");
}

File::~File() {
  const Quiet quiet;
  if (file_ >= 0) H5Fclose(file_);
}

void File::fail(const std::string& what, Status status) const {
  throw Error{status, input_.name() + ": " + what + " (HDF5)"};
}

bool File::has(const std::string& name) const {
  const Quiet quiet;
  for (std::size_t end = 0; end != std::string::npos;) {
    end = name.find('/', end + 1);
    const std::string part = name.substr(0, end);
    if (H5Lexists(file_, part.c_str(), H5P_DEFAULT) <= 0) return false;
    H5L_info_t link{};
    if (H5Lget_info(file_, part.c_str(), &link, H5P_DEFAULT) < 0 || link.type != H5L_TYPE_HARD)
      fail("\"" + part + "\" is a link to another place, which is not followed; export it as one file",
           Status::unsupported_input);
  }
  return true;
}

std::vector<std::string> File::names_in(const std::string& group) const {
  if (!has(group)) return {};
  const Quiet quiet;
  const Handle id(H5Gopen2(file_, group.c_str(), H5P_DEFAULT), H5Gclose);
  H5G_info_t info{};
  if (!id.is_open() || H5Gget_info(id, &info) < 0) fail("\"" + group + "\" is no group, or it is damaged");
  if (info.nlinks > most_names) fail("\"" + group + "\" has more than " + std::to_string(most_names) + " arrays");
  std::vector<std::string> names;
  for (hsize_t i = 0; i < info.nlinks; ++i) {
    std::array<char, longest_text> name{};
    const auto length =
        H5Lget_name_by_idx(id, ".", H5_INDEX_NAME, H5_ITER_INC, i, name.data(), name.size(), H5P_DEFAULT);
    if (length <= 0 || static_cast<std::size_t>(length) >= name.size())
      fail("a name in \"" + group + "\" is damaged or too long");
    names.emplace_back(name.data());
  }
  return names;
}

std::string File::text_attribute(const std::string& group, const char* attribute) const {
  const Quiet quiet;
  const std::string what = "the attribute " + std::string(attribute) + " of \"" + group + "\" is ";
  const Handle id(H5Aopen_by_name(file_, group.c_str(), attribute, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  if (!id.is_open()) fail(what + "missing; export it as VTKHDF", Status::unsupported_input);
  const Handle type(H5Aget_type(id), H5Tclose), space(H5Aget_space(id), H5Sclose);
  const std::size_t size = H5Tget_size(type);
  if (H5Tget_class(type) != H5T_STRING || H5Sget_simple_extent_npoints(space) != 1) fail(what + "no text");
  if (H5Tis_variable_str(type) > 0) {
    char* text = nullptr;
    const Handle wanted(H5Tcopy(H5T_C_S1), H5Tclose);
    H5Tset_size(wanted, H5T_VARIABLE);
    H5Tset_cset(wanted, H5Tget_cset(type));
    if (H5Aread(id, wanted, &text) < 0 || text == nullptr) fail(what + "damaged");
    const std::string result(text, std::find(text, text + longest_text, '\0'));
    H5free_memory(text);
    return result;
  }
  if (size == 0 || size > longest_text) fail(what + "damaged");
  std::string text(size, '\0');
  if (H5Aread(id, type, text.data()) < 0) fail(what + "damaged");
  return text.substr(0, text.find('\0'));
}

std::uint64_t File::first_of_attribute(const std::string& group, const char* attribute) const {
  const Quiet quiet;
  const std::string what = "the attribute " + std::string(attribute) + " of \"" + group + "\" is ";
  const Handle id(H5Aopen_by_name(file_, group.c_str(), attribute, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  if (!id.is_open()) fail(what + "missing; export it as VTKHDF", Status::unsupported_input);
  const Handle type(H5Aget_type(id), H5Tclose), space(H5Aget_space(id), H5Sclose);
  const auto values = H5Sget_simple_extent_npoints(space);
  if (!is_number(type) || values < 1 || values > 16) fail(what + "no number");
  std::array<double, 16> numbers{};
  if (H5Aread(id, H5T_NATIVE_DOUBLE, numbers.data()) < 0 || !(numbers[0] >= 0 && numbers[0] < 1e9))
    fail(what + "damaged");
  return static_cast<std::uint64_t>(numbers[0]);
}

File::Dataset File::opened(const std::string& name) const {
  if (!has(name)) fail("has no dataset \"" + name + "\"; export it again");
  Handle id(H5Dopen2(file_, name.c_str(), H5P_DEFAULT), H5Dclose);
  if (!id.is_open()) fail("\"" + name + "\" is no dataset, or it is damaged; export it again");
  Handle type(H5Dget_type(id), H5Tclose), space(H5Dget_space(id), H5Sclose);
  if (!type.is_open() || !space.is_open()) fail("\"" + name + "\" is damaged; export it again");
  if (!is_number(type)) fail("\"" + name + "\" does not hold numbers", Status::unsupported_input);
  Dataset dataset{std::move(id), std::move(type), std::move(space), {}, 0};
  std::array<hsize_t, H5S_MAX_RANK> sizes{};
  const int dimensions = H5Sget_simple_extent_dims(dataset.space, sizes.data(), nullptr);
  if (dimensions < 1 || dimensions > 2)
    fail("\"" + name + "\" has " + std::to_string(dimensions) + " dimensions, not 1 or 2", Status::unsupported_input);
  dataset.dimensions = static_cast<std::size_t>(dimensions);
  dataset.shape = {sizes[0], dimensions == 2 ? sizes[1] : 1};
  check_storage(dataset, name);
  return dataset;
}

/// Values that a file declares, but does not store, would be read as zeros. libhdf5 allocates a whole chunk at once,
/// and loads plug-ins for filters that it does not know.
void File::check_storage(const Dataset& dataset, const std::string& name) const {
  const std::uint64_t stored = std::min<std::uint64_t>(H5Dget_storage_size(dataset.id), input_.size());
  const std::uint64_t values = binary::times(dataset.shape.rows, dataset.shape.columns);
  if (binary::times(values, H5Tget_size(dataset.type)) > binary::times(stored, densest))
    fail("\"" + name + "\" declares " + std::to_string(values) + " values, more than it stores; it is damaged");
  const Handle creation(H5Dget_create_plist(dataset.id), H5Pclose);
  const H5D_layout_t layout = H5Pget_layout(creation);
  if (layout == H5D_VIRTUAL || H5Pget_external_count(creation) != 0)
    fail("\"" + name + "\" is stored in other files; export it as one file", Status::unsupported_input);
  const int filters = H5Pget_nfilters(creation);
  for (int i = 0; i < filters; ++i) {
    unsigned flags = 0, settings = 0;
    std::size_t setting_count = 0;
    const H5Z_filter_t filter =
        H5Pget_filter2(creation, static_cast<unsigned>(i), &flags, &setting_count, nullptr, 0, nullptr, &settings);
    if (filter != H5Z_FILTER_DEFLATE && filter != H5Z_FILTER_SHUFFLE && filter != H5Z_FILTER_FLETCHER32)
      fail("\"" + name + "\" is compressed by filter " + std::to_string(filter) + "; export it with gzip (deflate)",
           Status::unsupported_input);
  }
  if (layout != H5D_CHUNKED) return;
  std::array<hsize_t, 2> chunk{1, 1};
  if (H5Pget_chunk(creation, static_cast<int>(chunk.size()), chunk.data()) < 1) fail("\"" + name + "\" is damaged");
  const std::uint64_t bytes = binary::times(binary::times(chunk[0], chunk[1]), H5Tget_size(dataset.type));
  if (bytes == 0 || bytes / densest > input_.size())
    fail("\"" + name + "\" has chunks of " + std::to_string(bytes) + " bytes, too many for this file; it is damaged");
}

Shape File::shape(const std::string& name) const {
  const Quiet quiet;
  return opened(name).shape;
}

std::vector<double> File::read(const std::string& name, std::uint64_t first, std::uint64_t rows) const {
  const Quiet quiet;
  const Dataset dataset = opened(name);
  const std::uint64_t columns = dataset.shape.columns;
  if (binary::plus(first, rows) > dataset.shape.rows)
    fail("\"" + name + "\" has " + std::to_string(dataset.shape.rows) + " rows, but " + std::to_string(rows) +
         " from row " + std::to_string(first) + " are needed; it is damaged, export it again");
  std::vector<double> result(rows * columns);
  if (result.empty()) return result;
  const std::array<hsize_t, 2> start{first, 0}, count{rows, columns};
  const int dimensions = static_cast<int>(dataset.dimensions);
  const Handle memory(H5Screate_simple(dimensions, count.data(), nullptr), H5Sclose);
  if (H5Sselect_hyperslab(dataset.space, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr) < 0 ||
      H5Dread(dataset.id, H5T_NATIVE_DOUBLE, memory, dataset.space, H5P_DEFAULT, result.data()) < 0)
    fail("\"" + name + "\" cannot be read; it is damaged or cut short, export it again");
  return result;
}

std::vector<std::uint64_t> File::read_counts(const std::string& name, std::uint64_t first, std::uint64_t rows) const {
  constexpr double most = 9007199254740992.0;  // 2^53
  std::vector<std::uint64_t> counts;
  for (const double value : read(name, first, rows)) {
    if (!(value >= 0 && value < most)) fail("\"" + name + "\" has a negative or too large number; it is damaged");
    counts.push_back(static_cast<std::uint64_t>(value));
  }
  return counts;
}
}  // namespace lbea::io::hdf5
