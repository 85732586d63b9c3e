#include "client_lib/raw_topics.h"

#include "client_lib/recording/message_types.h"
#include "takt_topics.h"

namespace takt::client {
namespace {

std::string dds_name(const std::string& topic) {
  return "rt" + topic;
}

LinkProfile profile_of(const ClientOptions& options) {
  return {options.profiles_file, options.secure_directory, options.profile};
}

}  // namespace

struct RawTopics::Known : public dds::DataReaderListener {
  RawTopic topic;
  bool exclusive = false;
  const OnSample* on_sample = nullptr;
  dds::DataReader* reader = nullptr;
  std::string buffer;

  void on_data_available(dds::DataReader* from) override {
    dds::SampleInfo info;
    while (is_ok(from->take_next_sample(&buffer, &info)))
      if (info.valid_data) (*on_sample)(topic, buffer);
  }
};

class RawTopics::Watch : public DiscoveryListener {
 public:
  explicit Watch(RawTopics& owner) : owner_(owner) {}
  void on_writer(const DiscoveredWriter& writer) override {
    if (writer.news == DiscoveredWriter::News::gone) return;
    std::string name = writer.topic;
    if (!name.starts_with("rt/")) return;
    name.erase(0, 2);
    if (!owner_.is_wanted(name)) return;
    const std::string type = recording::message_name(writer.type);
    if (type.empty()) return;
    const std::lock_guard lock(owner_.mutex_);
    auto& known = owner_.topics_[name];
    if (known) return;
    known = std::make_unique<Known>();
    known->topic = {name, type, writer.latched, writer.reliable};
    known->exclusive = writer.exclusive;
    known->on_sample = &owner_.on_sample_;
    owner_.to_announce_.push_back(name);
    owner_.changed_.notify_all();
  }

 private:
  RawTopics& owner_;
};

/// All of the cell but requests and their replies, and those that all cells of a domain share.
bool RawTopics::is_wanted(const std::string& name) const {
  for (const TopicInfo* topic : topics::kAll) {
    const std::string own = "/" + topic->name(cell_);
    if (topic->qos == TopicQos::control && name == own) return false;
    if (!topic->pattern.starts_with("{") && name == own) return true;
  }
  return name.starts_with("/" + cell_ + "/");
}

RawTopics::RawTopics(const ClientOptions& options, OnTopic on_topic, OnSample on_sample)
    : cell_(options.cell),
      on_topic_(std::move(on_topic)),
      on_sample_(std::move(on_sample)),
      watch_(std::make_unique<Watch>(*this)),
      link_(std::make_unique<Link>(options.domain, options.name, profile_of(options), watch_.get())),
      thread_([this] { run(); }) {}

RawTopics::~RawTopics() {
  {
    const std::lock_guard lock(mutex_);
    over_ = true;
    changed_.notify_all();
  }
  thread_.join();
  link_.reset();  // ends the readers before what they call
}

void RawTopics::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [&] { return over_ || !to_announce_.empty(); });
    if (over_) return;
    const RawTopic topic = topics_.at(to_announce_.front())->topic;
    to_announce_.erase(to_announce_.begin());
    lock.unlock();
    on_topic_(topic);
    lock.lock();
  }
}

void RawTopics::open(const std::string& name, int depth) {
  Known* known = nullptr;
  {
    const std::lock_guard lock(mutex_);
    const auto found = topics_.find(name);
    if (found == topics_.end() || found->second->reader != nullptr) return;
    known = found->second.get();
  }
  const auto qos = reader_qos(link_->default_reader_qos(), {.reliable = known->topic.reliable,
                                                            .latched = known->topic.latched,
                                                            .depth = depth,
                                                            .exclusive = known->exclusive});
  dds::DataReader* reader = link_->create_reader(
      dds_name(name), dds::TypeSupport(new BytesType(recording::dds_type_name(known->topic.type))), qos,
      known);
  const std::lock_guard lock(mutex_);
  known->reader = reader;
}

void RawTopics::close(const std::string& name) {
  dds::DataReader* reader = nullptr;
  {
    const std::lock_guard lock(mutex_);
    const auto found = topics_.find(name);
    if (found != topics_.end()) std::swap(reader, found->second->reader);
  }
  if (reader != nullptr) link_->remove(reader);
}

RawPublisher::RawPublisher(const ClientOptions& options)
    : link_(options.domain, options.name, profile_of(options)) {}

RawPublisher::~RawPublisher() = default;

void RawPublisher::add(const RawTopic& topic) {
  if (writers_.contains(topic.name)) return;
  // A description has megabytes, which go out in fragments.
  const auto qos = writer_qos(link_.default_writer_qos(), {.reliable = topic.reliable,
                                                           .latched = topic.latched,
                                                           .depth = topic.latched ? 1 : 100,
                                                           .large = true});
  writers_[topic.name] = link_.create_writer(
      dds_name(topic.name), dds::TypeSupport(new BytesType(recording::dds_type_name(topic.type))), qos,
      nullptr);
}

bool RawPublisher::write(const std::string& topic, std::string_view sample) {
  std::string bytes(sample);
  const auto found = writers_.find(topic);
  return found != writers_.end() && written(*found->second, bytes);
}

}  // namespace takt::client
