#include "client_lib/gateway/modbus/table.h"

#include <algorithm>
#include <cmath>

namespace takt::gateway::modbus {

Table::Table(std::vector<Element> elements) : elements_(std::move(elements)), written_(elements_.size(), 0) {
  for (const Element& element : elements_) {
    auto& values = memory(element.area);
    values.resize(std::max(values.size(), element.address + element.count()), 0);
  }
}

double Table::number(std::size_t element) const {
  const Element& e = elements_[element];
  const std::uint16_t* at = memory(e.area).data() + e.address;
  return is_bits(e.area) ? *at : from_registers(at, e.type, e.order);
}

bool Table::set(std::size_t element, double number) {
  const Element& e = elements_[element];
  std::uint16_t* at = memory(e.area).data() + e.address;
  bool beyond = false;
  if (is_bits(e.area))
    *at = number != 0.0 ? 1 : 0;
  else
    std::ranges::copy(to_registers(number, e.type, e.order, beyond), at);
  return !beyond;
}

std::vector<std::size_t> Table::take_written() {
  std::vector<std::size_t> taken;
  for (std::size_t i = 0; i < written_.size(); ++i)
    if (written_[i] != 0) taken.push_back(i);
  std::fill(written_.begin(), written_.end(), 0);
  return taken;
}

bool Table::read_bits(bool coils, std::size_t first, std::size_t count, std::vector<bool>& bits) {
  const auto& values = memory(coils ? Area::coils : Area::discrete_inputs);
  if (first + count > values.size()) return false;
  bits.resize(count);
  for (std::size_t i = 0; i < count; ++i) bits[i] = values[first + i] != 0;
  return true;
}

bool Table::read_registers(bool holding, std::size_t first, std::size_t count,
                           std::vector<std::uint16_t>& values) {
  const auto& all = memory(holding ? Area::holding_registers : Area::input_registers);
  if (first + count > all.size()) return false;
  const auto begin = all.begin() + static_cast<std::ptrdiff_t>(first);
  values.assign(begin, begin + static_cast<std::ptrdiff_t>(count));
  return true;
}

Exception Table::write(Area area, std::size_t first, std::span<const std::uint16_t> values) {
  auto& all = memory(area);
  const std::size_t end = first + values.size();
  if (end > all.size()) return Exception::illegal_address;
  std::vector<std::size_t> covered;
  for (std::size_t i = 0; i < elements_.size(); ++i) {
    const Element& e = elements_[i];
    if (e.area != area || e.address >= end || e.address + e.count() <= first) continue;
    if (e.address < first || e.address + e.count() > end) return Exception::illegal_address;
    const std::uint16_t* at = values.data() + (e.address - first);
    const double number = is_bits(area) ? *at : from_registers(at, e.type, e.order);
    if (!(number >= e.lower && number <= e.upper) || !std::isfinite(number)) return Exception::illegal_value;
    covered.push_back(i);
  }
  std::ranges::copy(values, all.begin() + static_cast<std::ptrdiff_t>(first));
  for (const std::size_t i : covered) written_[i] = 1;
  return Exception::none;
}

Exception Table::write_coils(std::size_t first, const std::vector<bool>& bits) {
  const std::vector<std::uint16_t> values(bits.begin(), bits.end());
  return write(Area::coils, first, values);
}

Exception Table::write_registers(std::size_t first, const std::vector<std::uint16_t>& values) {
  return write(Area::holding_registers, first, values);
}

}  // namespace takt::gateway::modbus
