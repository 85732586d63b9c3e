// Saving and loading of Connections.

#include "plant_models/state_bytes.h"
#include "server/contact/holding/connections.h"

namespace takt {

void Connections::save(StateWriter& out) const {
  for (const int partner : partner_) out.put(partner);
  for (const int support : passes_to_) out.put(support);
  for (const Renewal renewal : renew_) out.put(renewal);
  tree_.save(out);
  out.put_size(list_.size());
  for (const PairConnection& pair : list_) {
    const Connection& connection = pair.connection;
    out.put(pair.base), out.put(connection.partner);
    out.put(connection.p_TBcm_T), out.put(connection.R_TB);
    out.put(connection.softening), out.put(connection.feed_forward_W);
    if (may_slide_) out.put(connection.slides), out.put(connection.slide_W), out.put(connection.slide_from_s);
  }
}

void Connections::load(StateReader& in) {
  ++version_;
  // Already set by load_attached() of the interaction and its owners.
  const std::vector<double> stiffness = stiffness_;
  reset();
  stiffness_ = stiffness;
  const std::size_t n = components_.size();
  const auto name = [this](int id) { return component(id).name; };
  for (std::size_t i = 0; i < n; ++i) {
    partner_[i] = in.index(n, "a partner");
    if (partner_[i] != -1 && !is_part(static_cast<int>(i)))
      in.fail(name(static_cast<int>(i)) + " has a partner, but is no Part");
  }
  for (std::size_t i = 0; i < n; ++i) {
    std::size_t length = 0;  // partners of partners must come to an end
    for (int at = static_cast<int>(i); at != -1 && is_part(at); at = partner(at))
      if (++length > n) in.fail("the partners of " + name(static_cast<int>(i)) + " go in a circle");
  }
  for (std::size_t i = 0; i < n; ++i) {
    passes_to_[i] = in.index(n, "where a weight passes to");
    if (passes_to_[i] == -1) continue;
    int end = static_cast<int>(i);
    while (end != -1 && is_part(end)) end = partner(end);
    if (end == -1 || !is_part(static_cast<int>(i)))
      in.fail("the weight of " + name(static_cast<int>(i)) + " passes to something, but nothing carries it");
  }
  for (Renewal& renewal : renew_)
    renewal = static_cast<Renewal>(in.integer(0, static_cast<int>(Renewal::all), "a renewal"));
  tree_.load(in);
  const std::size_t count = in.size(n * n, "connections");
  for (std::size_t i = 0; i < count; ++i) {
    PairConnection pair;
    Connection& connection = pair.connection;
    pair.base = in.index(n, "the Base of a connection");
    connection.partner = in.index(n, "the Target of a connection");
    if (pair.base == -1 || connection.partner == -1 || !is_part(pair.base) || pair.base == connection.partner)
      in.fail("a connection joins what cannot be connected");
    if (!list_.empty() && !(list_.back().key() < pair.key())) in.fail("the connections are not in order");
    connection.p_TBcm_T = in.vector("the offset of a connection");
    connection.R_TB = in.rotation("the orientation of a connection");
    connection.softening = in.number(1e-12, 1.0, "the softening of a connection");
    connection.feed_forward_W = in.vector("the weight that a connection carries");
    connection.gains = own_gains(pair.base, connection.softening);
    if (may_slide_) {
      connection.slides = in.flag("'slides'");
      connection.slide_W = in.vector("the sliding of a connection");
      connection.slide_from_s = in.number("the time of a sliding");
    }
    list_.push_back(pair);
  }
  index_list();
}

}  // namespace takt
