// Output to a terminal, pipe, socket or file that perhaps nobody reads.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace lbea::tool {

class Outlet {
 public:
  /// The descriptor stays open, and its flags, which other programs share, stay as they are.
  explicit Outlet(int descriptor);
  ~Outlet();
  Outlet(const Outlet&) = delete;
  Outlet& operator=(const Outlet&) = delete;
  /// Whether all of `text` was written; errno is set when not. Without a reader it waits until `gives_up` returns true.
  bool write(std::string_view text, const std::function<bool()>& gives_up) const;

 private:
  class Stream;
  std::shared_ptr<Stream> stream_;
};

}  // namespace lbea::tool
