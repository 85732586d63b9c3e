#include "client_lib/client_impl.h"

#include <unistd.h>

#include <algorithm>
#include <optional>
#include <random>

#include "idl/transport/fastdds/server_participant.h"
#include "ros2_msgs.h"
#include "takt_msgs.h"

namespace takt {
namespace {

/// Unique among all clients that ever talk to a server: the name, the process, and chance.
std::string unique_id(const std::string& name) {
  std::random_device chance;
  char suffix[32];
  std::snprintf(suffix, sizeof(suffix), "-%ld-%08x", static_cast<long>(getpid()),
                static_cast<unsigned>(chance()));
  return name.substr(0, 80) + suffix;
}

}  // namespace

Client::Impl::Impl(ClientOptions given)
    : options(std::move(given)),
      id(unique_id(options.name)),
      link(options.domain, id, {options.profiles_file, options.secure_directory, options.profile}, &watch) {
  if (options.cell.empty()) throw ClientError(ClientError::Kind::invalid, "The name of the cell is empty.");
  changed.receive_with(link.receiver());
}

bool Client::Impl::connect(Clock::time_point deadline, Clock::duration patience) {
  const auto listen = [&]<typename Type>(const Topic<Type>& topic,
                                         typename client::ReaderListener<Type>::OnMatch on_match = {}) {
    return &make_reader(topic, topic.name(options.cell), std::move(on_match));
  };
  using Prefix = const GuidPrefix&;
  status = listen(topics::status, [this](Prefix from, bool matched) { on_status_match(from, matched); });
  listen(topics::event);
  state = listen(topics::state);
  reply_listener = std::make_unique<client::ReaderListener<takt_msgs::msg::ControlReply>>(
      [this](const auto& sample, Prefix) { on_reply(sample); },
      [this](Prefix, bool matched) {
        const std::lock_guard lock(mutex);
        reply_writers += matched ? 1 : -1;
        control_is_open = false;  // another server: see open_control
        changed.notify_all();
      });
  link.create_reader(topics::control_reply, topics::control_reply.name(options.cell), reply_listener.get());
  description = listen(topics::description);

  std::unique_lock lock(mutex);
  const std::string participant = std::string(kServerParticipant) + options.cell;
  std::optional<Clock::time_point> present_since;
  for (;;) {
    if (cell && status->newest() != nullptr) return true;
    const auto now = Clock::now();
    if (now >= deadline) break;
    const auto present = watch.participants();
    if (std::find(present.begin(), present.end(), participant) == present.end())
      present_since.reset();
    else if (!present_since)
      present_since = now;
    else if (now - *present_since > patience)
      return false;
    constexpr std::chrono::seconds kLook{1};
    changed.wait_until(lock, std::min<Clock::time_point>(deadline, now + kLook));
  }
  lock.unlock();

  std::string sentence = where();
  const auto names = watch.names();
  if (std::find(names.begin(), names.end(), options.cell) != names.end()) {
    sentence += cell ? " has sent its description but not its status"
                     : " is announced, but its description has not come";
  } else {
    sentence += " does not answer; ";
    for (const auto& name : names)
      sentence += (&name == &names.front() ? "found there: '" : ", '") + name + "'";
    if (names.empty())
      sentence +=
          options.secure_directory.empty()
              ? "no takt-server was found there (is it running, on this domain? A secured one "
                "answers clients with an identity only: --secure)"
              : "no takt-server was found there (is it running, on this domain, secured, and of the same "
                "authority as this identity?)";
  }
  char waited[48];
  std::snprintf(waited, sizeof(waited), " (waited %.1f s).", options.timeout.count());
  throw ClientError(ClientError::Kind::not_found, sentence + waited);
}

bool Client::Impl::from_this_server(const GuidPrefix& from) {
  if (server && *server != from) return false;
  heard = Clock::now();
  return true;
}

void Client::Impl::restore_description() {
  std::swap(cell, cell_before);
  for (auto& [name, reader] : topic_readers) reader->on_description(false, true);
  const auto same = std::const_pointer_cast<CellInfo>(cell);
  description->samples.assign(1, {same, ++description->count});
  changed.notify_all();
}

void Client::Impl::on_description(ReaderOf<takt_msgs::msg::CellDescription>& of,
                                  const takt_msgs::msg::CellDescription& sample, const GuidPrefix& from) {
  auto made = std::make_shared<CellInfo>(sample);
  const std::lock_guard lock(mutex);
  const bool other_server = server && *server != from;  // started again: nothing known of the old one holds
  if (cell && server == from && *static_cast<const takt_msgs::msg::CellDescription*>(cell.get()) == sample) {
    gone = false;  // the same once more, after the server was discovered again
    heard = Clock::now();
    changed.notify_all();
    return;
  }
  const bool other_scenario = cell && cell->scenario_generation != made->scenario_generation;
  cell_before = other_server ? nullptr : cell;
  server = from;
  gone = false;
  heard = Clock::now();
  cell = made;
  if (other_server || other_scenario) known = {0, 0};
  for (auto& [name, reader] : topic_readers) reader->on_description(other_server, other_scenario);
  of.keep(std::move(made));
  changed.notify_all();
}

void Client::Impl::on_status_match(const GuidPrefix& from, bool matched) {
  const std::lock_guard lock(mutex);
  if (server && *server == from) gone = !matched;
  changed.notify_all();
}

template <Message Type>
Client::Impl::ReaderOf<Type>& Client::Impl::make_reader(
    const Topic<Type>& topic, const std::string& name,
    typename client::ReaderListener<Type>::OnMatch on_match) {
  auto made = std::make_unique<ReaderOf<Type>>(*this, topic, std::move(on_match));
  ReaderOf<Type>& reader = *made;
  {
    const std::lock_guard lock(mutex);
    topic_readers[name] = std::move(made);
  }
  try {
    link.create_reader(topic, name, &reader.listener);
  } catch (const ClientError&) {
    const std::lock_guard lock(mutex);
    topic_readers.erase(name);
    throw;
  }
  return reader;
}

Client::Impl::Reader& Client::Impl::reader_of(const TopicInfo& topic, const std::string& element) {
  require_own_process();
  if (!topic.is_for_clients())
    throw ClientError(ClientError::Kind::invalid,
                      "Clients do not read the topic '" + std::string(topic.id) + "'.");
  const std::string kind(topic.element_kind()), name = topic.name(options.cell, element);
  const auto known_reader = [&]() -> Reader* {
    const std::lock_guard lock(mutex);
    if (!kind.empty()) (void)require_by_name(kind.c_str(), *cell->lists.find(kind + "s"), element);
    const auto found = topic_readers.find(name);
    return found == topic_readers.end() ? nullptr : found->second.get();
  };
  if (Reader* reader = known_reader()) return *reader;
  const std::lock_guard making(senders_mutex);
  if (Reader* reader = known_reader()) return *reader;  // made meanwhile
  Reader* made = nullptr;
  topics::for_each([&](const auto& one) {
    if (one.id == topic.id) made = &make_reader(one, name);
  });
  return *made;
}

Client::Received Client::next_sample(const TopicInfo& topic, const std::string& element, std::uint64_t seen,
                                     Clock::time_point deadline) const {
  Impl::Reader& reader = impl_->reader_of(topic, element);
  std::unique_lock lock(impl_->mutex);
  if (!impl_->wait(lock, deadline, [&] { return reader.has_another(seen); })) return {};
  return reader.hand_out();
}

void Client::Impl::on_reply(const takt_msgs::msg::ControlReply& sample) {
  if (sample.client_id != id) return;
  const std::lock_guard lock(mutex);
  const auto waiting = replies.find(sample.sequence_number);
  if (waiting == replies.end()) return;
  waiting->second = sample;
  changed.notify_all();
}

Client::Impl::Sender& Client::Impl::open_sender(const TopicInfo& info, const std::string& element,
                                                MakeType type) {
  const std::string topic = info.name(options.cell, element);
  const std::lock_guard making(senders_mutex);
  auto& slot = senders[topic];
  if (slot) return *slot;
  auto made = std::make_unique<Sender>();
  made->listener = std::make_unique<client::WriterListener>(
      [this, s = made.get()](const dds::PublicationMatchedStatus& match) {
        const GuidPrefix reader = client::participant_of(match.last_subscription_handle);
        const std::lock_guard lock(mutex);
        if (match.current_count_change > 0)
          s->readers.push_back(reader);
        else if (const auto one = std::find(s->readers.begin(), s->readers.end(), reader);
                 one != s->readers.end())
          s->readers.erase(one);
        changed.notify_all();
      },
      [this, s = made.get()](int policy) {
        const std::lock_guard lock(mutex);
        s->incompatible_policy = policy;
        changed.notify_all();
      });
  auto qos = writer_qos(link.default_writer_qos(), qos_of(info));
  qos.ownership_strength().value = options.ownership_strength;
  made->writer = link.create_writer("rt/" + topic, type(), qos, made->listener.get());
  slot = std::move(made);
  return *slot;
}

Client::Impl::Sender& Client::Impl::sender_for(const TopicInfo& info, const std::string& element,
                                               MakeType type) {
  Sender& sender = open_sender(info, element, type);
  std::unique_lock lock(mutex);
  if (!wait(lock, deadline_after(options.timeout), [&] {
        return server &&
               std::find(sender.readers.begin(), sender.readers.end(), *server) != sender.readers.end();
      }))
    throw ClientError(
        ClientError::Kind::timeout,
        where() + " does not listen to " + info.name(options.cell, element).substr(options.cell.size() + 1) +
            (sender.incompatible_policy == 0
                 ? std::string(".")
                 : " with this client's QoS (policy " + std::to_string(sender.incompatible_policy) +
                       " does not fit: client and server are of different versions)."));
  return sender;
}

void Client::Impl::write(Sender& sender, void* sample, const std::string& what) {
  require_own_process();
  if (!is_ok(sender.writer->write(sample, dds::HANDLE_NIL)))
    throw ClientError(ClientError::Kind::transport,
                      "DDS could not send " + what + " to cell '" + options.cell + "'.");
}

/// Checks the bounds of the message type. The server cannot read a request beyond them and would never answer.
void require_room(const std::string& name, const Arguments& arguments) {
  const auto within = [&](const std::string& what, std::size_t found, std::size_t most) {
    if (found > most)
      throw ClientError(ClientError::Kind::invalid, "The request '" + name.substr(0, 64) + "' has " + what +
                                                        " " + std::to_string(found) + "; at most " +
                                                        std::to_string(most) + " are possible.");
  };
  within("a name with characters:", name.size(),
         field_info<takt_msgs::msg::ControlRequest>("request").string_bound);
  within("arguments:", arguments.size(), field_info<takt_msgs::msg::ControlRequest>("arguments").bound);
  for (const auto& argument : arguments)
    within("an argument whose name has characters:", argument.name.size(),
           field_info<takt_msgs::msg::Argument>("name").string_bound);
}

std::uint64_t Client::Impl::write_request(const std::string& name, const Arguments& arguments) {
  require_room(name, arguments);
  takt_msgs::msg::ControlRequest request;
  request.client_id = id;
  request.request = name;
  request.arguments = arguments;
  constexpr std::size_t kMost = cdr::max_bytes<takt_msgs::msg::ControlRequest>();
  if (const std::size_t bytes = cdr::size(request); bytes > kMost)
    throw ClientError(ClientError::Kind::invalid, "The request '" + name + "' has " + std::to_string(bytes) +
                                                      " bytes; at most " + std::to_string(kMost) +
                                                      " are possible.");
  auto& sender = sender_for(topics::control_request, {}, [] {
    return dds::TypeSupport(new MessageType<takt_msgs::msg::ControlRequest>());
  });
  {
    const std::lock_guard lock(mutex);
    request.sequence_number = next_sequence++;
    replies.emplace(request.sequence_number, std::nullopt);
  }
  write(sender, &request, "the request '" + name + "'");
  return request.sequence_number;
}

/// That both ends of our side are matched does not say that the server's writer already knows our reader; a
/// reply written before would be lost. So a harmless request is repeated until one is answered; from then on
/// none is lost.
void Client::Impl::open_control(Clock::time_point deadline) {
  std::unique_lock lock(mutex);
  if (control_is_open) return;
  std::vector<std::uint64_t> tries;
  while (!control_is_open) {
    lock.unlock();
    tries.push_back(write_request(std::string(request_info<requests::GetState>().name), {}));
    lock.lock();
    const auto answered = [&] {
      return std::any_of(tries.begin(), tries.end(),
                         [&](std::uint64_t n) { return replies.at(n).has_value(); });
    };
    control_is_open = wait(lock, std::min(deadline, Clock::now() + std::chrono::milliseconds{250}), answered);
    if (!control_is_open && Clock::now() >= deadline) break;
  }
  for (const std::uint64_t n : tries) replies.erase(n);
  if (!control_is_open)
    throw ClientError(ClientError::Kind::timeout, where() + " does not answer on its control topics.");
}

Reply Client::Impl::call(const std::string& name, const Arguments& arguments, Seconds timeout) {
  const auto deadline = deadline_after(timeout);
  open_control(deadline);
  std::unique_lock lock(mutex);
  const std::uint32_t generation_before = cell->scenario_generation;
  lock.unlock();
  const std::uint64_t sequence = write_request(name, arguments);
  lock.lock();
  struct Forget {
    std::map<std::uint64_t, std::optional<takt_msgs::msg::ControlReply>>& replies;
    std::uint64_t sequence;
    ~Forget() { replies.erase(sequence); }
  } forget{replies, sequence};
  if (!wait(lock, deadline, [&] { return replies.at(sequence).has_value(); })) {
    char sentence[160];
    std::snprintf(sentence, sizeof(sentence), " has not answered '%s' within %.1f s.", name.c_str(),
                  timeout.count());
    throw ClientError(ClientError::Kind::timeout, where() + sentence);
  }
  const auto reply = *std::move(replies.at(sequence));
  if (reply.result != static_cast<int>(ControlResult::ok))
    throw ClientError(
        ClientError::Kind::refused,
        "Request '" + name + "' was refused (result " + std::to_string(reply.result) + "): " + reply.message,
        static_cast<ControlResult>(reply.result));
  apply_reply_causality(lock, name, reply.values, generation_before, deadline);
  return {reply.message, reply.values};
}

}  // namespace takt
