// One viewer that speaks Foxglove's protocol. Only the web server's own files include this: Beast is large.
#pragma once

#include "tools/monitor/web/foxglove.hpp"
#include "tools/monitor/web/web_session.hpp"

#include <deque>

namespace lbea::tool::web {

/// Gets what it subscribed to. Of what it reads too slowly the oldest is left out, and it is told of how many messages.
class Viewer : public std::enable_shared_from_this<Viewer> {
 public:
  Viewer(beast::tcp_stream stream, Shared& shared, Seat seat);
  ~Viewer();
  /// `subprotocol` of the two that are spoken.
  void accept(const Request& request, std::string_view subprotocol);
  void offer(const std::shared_ptr<const ViewerMessage>& message);

 private:
  void read();
  void take();
  void drop_oldest(ViewerChannel channel);
  void write_next();
  void write_text(std::string text);
  void write_message();
  void written(beast::error_code error);
  websocket::stream<beast::tcp_stream> stream_;
  Shared& shared_;
  Seat connection_, viewing_;
  beast::flat_buffer buffer_;
  ViewerSubscriptions subscriptions_;
  std::deque<std::string> greeting_;
  std::string complaint_;  // one at a time: what is said in between is answered once
  std::deque<std::shared_ptr<const ViewerMessage>> waiting_;
  std::array<std::size_t, viewer_channels> waiting_of_{};
  std::uint64_t left_out_ = 0;
  unsigned complaints_ = 0;
  std::string text_;
  std::array<char, viewer_head_bytes> head_{};
  std::shared_ptr<const ViewerMessage> in_flight_;
  bool open_ = false, writing_ = false;
};

}  // namespace lbea::tool::web
