// Replaces server.cpp in builds without Boost (LBEA_HTTP=OFF).
#include "adapters/http/server.hpp"

#include <lbea/lbea.hpp>

namespace lbea::http {
struct Server::State {
  Address address;
};

Server::Server(const Address&, Limits, std::string) {
  throw Error(Status::bad_config, "this build has no HTTP server; build it with LBEA_HTTP=ON");
}
Server::~Server() = default;
void Server::start(Handler&) {}
const Address& Server::address() const noexcept { return state_->address; }
void Server::post(std::function<void()>) {}
}  // namespace lbea::http
