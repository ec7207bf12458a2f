#include "adapters/mcap/bytes.hpp"

#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <memory>

namespace lbea::mcap {
namespace {
constexpr std::array<std::string_view, 3> names{"", "lz4", "zstd"};
constexpr std::size_t first_room = std::size_t{1} << 16;

struct FreeLz4 {
  void operator()(LZ4F_cctx* context) const { LZ4F_freeCompressionContext(context); }
  void operator()(LZ4F_dctx* context) const { LZ4F_freeDecompressionContext(context); }
};
struct FreeZstd {
  void operator()(ZSTD_CCtx* context) const { ZSTD_freeCCtx(context); }
  void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
};

bool compress_lz4(std::span<const Bytes> pieces, Buffer& out) {
  LZ4F_cctx* made = nullptr;
  if (LZ4F_isError(LZ4F_createCompressionContext(&made, LZ4F_VERSION)) != 0) return false;
  const std::unique_ptr<LZ4F_cctx, FreeLz4> context(made);
  std::size_t used = out.size();
  const auto step = [&](std::size_t bound, auto call) {
    out.resize(used + bound);
    const std::size_t written = call(out.data() + used, bound);
    if (LZ4F_isError(written) != 0) return false;
    used += written;
    return true;
  };
  bool good = step(LZ4F_HEADER_SIZE_MAX,
                   [&](void* to, std::size_t room) { return LZ4F_compressBegin(context.get(), to, room, nullptr); });
  for (const Bytes piece : pieces)
    good = good && step(LZ4F_compressBound(piece.size(), nullptr), [&](void* to, std::size_t room) {
             return LZ4F_compressUpdate(context.get(), to, room, piece.data(), piece.size(), nullptr);
           });
  good = good && step(LZ4F_compressBound(0, nullptr),
                      [&](void* to, std::size_t room) { return LZ4F_compressEnd(context.get(), to, room, nullptr); });
  out.resize(used);
  return good;
}

bool compress_zstd(std::span<const Bytes> pieces, Buffer& out) {
  const std::unique_ptr<ZSTD_CCtx, FreeZstd> context(ZSTD_createCCtx());
  if (context == nullptr) return false;
  const std::size_t begin = out.size();
  out.resize(begin + ZSTD_compressBound(total_size(pieces)) + ZSTD_CStreamOutSize());
  ZSTD_outBuffer to{out.data() + begin, out.size() - begin, 0};
  for (const Bytes piece : pieces) {
    ZSTD_inBuffer from{piece.data(), piece.size(), 0};
    while (from.pos < from.size)
      if (ZSTD_isError(ZSTD_compressStream2(context.get(), &to, &from, ZSTD_e_continue)) != 0) return false;
  }
  ZSTD_inBuffer nothing{nullptr, 0, 0};
  const std::size_t left = ZSTD_compressStream2(context.get(), &to, &nothing, ZSTD_e_end);
  out.resize(begin + to.pos);
  return left == 0;
}

/// Calls `step(room)` with increasing room at the end of `out` until it is complete. The room is one byte larger than
/// the expected size, so that surplus data are detected.
template <class Step>
bool grow(std::uint64_t size, Buffer& out, Step step) {
  out.clear();
  std::size_t used = 0;
  while (true) {
    if (used == out.size()) {
      if (used > size) return false;
      const std::uint64_t want = std::max<std::uint64_t>(first_room, std::uint64_t{used} * 2);
      out.resize(static_cast<std::size_t>(std::min<std::uint64_t>(want, size + 1)));
    }
    const auto [written, state] = step(std::span(out).subspan(used));
    used += written;
    if (state < 0) return false;
    if (state > 0) break;
  }
  out.resize(used);
  return used == size;
}

struct Step {
  std::size_t written;
  int state;  // < 0: damaged, 0: incomplete, > 0: complete
};

bool decompress_lz4(Bytes bytes, std::uint64_t size, Buffer& out) {
  LZ4F_dctx* made = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&made, LZ4F_VERSION)) != 0) return false;
  const std::unique_ptr<LZ4F_dctx, FreeLz4> context(made);
  return grow(size, out, [&](std::span<std::byte> room) -> Step {
    std::size_t written = room.size(), read = bytes.size();
    const std::size_t more = LZ4F_decompress(context.get(), room.data(), &written, bytes.data(), &read, nullptr);
    if (LZ4F_isError(more) != 0) return {0, -1};
    bytes = bytes.subspan(read);
    if (more == 0) return {written, bytes.empty() ? 1 : -1};
    const bool stuck = read == 0 && written == 0;
    return {written, stuck ? -1 : 0};
  });
}

bool decompress_zstd(Bytes bytes, std::uint64_t size, Buffer& out) {
  const std::unique_ptr<ZSTD_DCtx, FreeZstd> context(ZSTD_createDCtx());
  if (context == nullptr) return false;
  ZSTD_inBuffer from{bytes.data(), bytes.size(), 0};
  return grow(size, out, [&](std::span<std::byte> room) -> Step {
    ZSTD_outBuffer to{room.data(), room.size(), 0};
    const std::size_t before = from.pos;
    const std::size_t more = ZSTD_decompressStream(context.get(), &to, &from);
    if (ZSTD_isError(more) != 0) return {0, -1};
    if (more == 0) return {to.pos, from.pos == from.size ? 1 : -1};
    const bool stuck = from.pos == before && to.pos == 0;
    return {to.pos, stuck ? -1 : 0};
  });
}
}  // namespace

std::string_view name_of(Compression compression) noexcept { return names[static_cast<std::size_t>(compression)]; }

std::optional<Compression> compression_named(std::string_view name) noexcept {
  const auto found = std::ranges::find(names, name);
  if (found == names.end()) return std::nullopt;
  return static_cast<Compression>(found - names.begin());
}

bool compress(Compression compression, std::span<const Bytes> pieces, Buffer& out) {
  return compression == Compression::lz4 ? compress_lz4(pieces, out) : compress_zstd(pieces, out);
}

bool decompress(Compression compression, Bytes bytes, std::uint64_t size, Buffer& out) {
  if (compression == Compression::lz4) return decompress_lz4(bytes, size, out);
  if (compression == Compression::zstd) return decompress_zstd(bytes, size, out);
  out.assign(bytes.begin(), bytes.end());
  return out.size() == size;
}
}  // namespace lbea::mcap
