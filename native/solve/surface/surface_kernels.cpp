#include "solve/surface/surface_kernels.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <list>
#include <utility>

namespace beamspread {

namespace {

// Bytes of all kernels that are kept, the last ones in any case, and their number. More: fewer tables are made anew.
constexpr std::size_t max_bytes = std::size_t{128} << 20;
constexpr std::size_t max_kernels = 16;

// The choice and some numbers of the LDFs. An address would not do: a new LDF may lie where a former one was, and a copy
// with curvatures differs from its original in these numbers alone.
using Key = std::vector<double>;

Key key_of(const KernelChoice& choice)
{
    Key key{choice.max_angle_deg, choice.texel, choice.is_colored ? 1.0 : 0.0, choice.tolerance};
    for (std::size_t c = 0; c < choice.channels.size(); ++c) {
        const ChannelMedium& channel = choice.channels[c];
        key.insert(key.end(), {channel.albedo, channel.mean_free_path, static_cast<double>(channel.side)});
        const auto known = std::find(choice.channels.begin(), choice.channels.end(), channel) - choice.channels.begin();
        key.push_back(static_cast<double>(known));
        if (static_cast<std::size_t>(known) < c)
            continue;
        const std::vector<double> curvatures = channel.ldf->curvatures();
        key.push_back(static_cast<double>(curvatures.size()));
        key.insert(key.end(), curvatures.begin(), curvatures.end());
        for (const std::size_t k : {std::size_t{0}, curvatures.size() / 2, curvatures.size() - 1})
            for (const RadialProfile& node : channel.ldf->curved_node_profiles(channel.albedo, channel.side, k)) {
                const Harmonics inside = node.cumulative(1.0);
                key.insert(key.end(), {node.total(), inside[0], inside[1]});
            }
    }
    return key;
}

// Kernels by their keys, those used last first.
class RecentKernels {
public:
    std::shared_ptr<SurfaceKernels> find(const Key& key)
    {
        const std::lock_guard lock(m_lock);
        const auto known =
            std::find_if(m_entries.begin(), m_entries.end(), [&](const Entry& entry) { return entry.first == key; });
        if (known == m_entries.end())
            return nullptr;
        m_entries.splice(m_entries.begin(), m_entries, known);
        return known->second;
    }

    // Keeps kernels, but for those that another thread has kept meanwhile, and returns those that are kept.
    std::shared_ptr<SurfaceKernels> keep(const Key& key, std::shared_ptr<SurfaceKernels> kernels)
    {
        if (std::shared_ptr<SurfaceKernels> known = find(key))
            return known;
        const std::lock_guard lock(m_lock);
        m_entries.emplace_front(key, kernels);
        std::size_t bytes = 0;
        std::size_t count = 0;
        for (auto entry = m_entries.begin(); entry != m_entries.end();) {
            bytes += entry->second->bytes();
            ++count;
            entry = count > 1 && (bytes > max_bytes || count > max_kernels) ? m_entries.erase(entry) : std::next(entry);
        }
        return kernels;
    }

private:
    using Entry = std::pair<Key, std::shared_ptr<SurfaceKernels>>;

    std::mutex m_lock;
    std::list<Entry> m_entries;
};

// The entry of a table, made without the lock: the loops that make it may wait for other threads, which may want it.
template <class Table, class Make>
std::shared_ptr<const Table> find_or_make(std::mutex& lock, std::map<int, std::shared_ptr<const Table>>& tables,
                                          int key, const Make& make)
{
    {
        const std::lock_guard guard(lock);
        if (const auto known = tables.find(key); known != tables.end())
            return known->second;
    }
    auto table = std::make_shared<const Table>(make());
    const std::lock_guard guard(lock);
    return tables.emplace(key, std::move(table)).first->second;
}

}  // namespace

SurfaceKernels::SurfaceKernels(const KernelChoice& choice)
    : m_tolerance(choice.tolerance),
      m_basis(choice.channels, choice.max_angle_deg, choice.texel, choice.is_colored, choice.tolerance)
{
    for (const std::vector<ScaledProfile>& profiles : m_basis.terms.basis.profiles)
        for (const ScaledProfile& profile : profiles)
            m_reach = std::max(m_reach, static_cast<float>(profile.reach));
}

std::shared_ptr<SurfaceKernels> SurfaceKernels::recent(const KernelChoice& choice)
{
    static RecentKernels all;
    const Key key = key_of(choice);
    if (std::shared_ptr<SurfaceKernels> known = all.find(key))
        return known;
    return all.keep(key, std::make_shared<SurfaceKernels>(choice));
}

std::shared_ptr<const DiskTable> SurfaceKernels::disk(int number)
{
    const float radius = std::exp2(static_cast<float>(number) / radii_per_octave);
    return find_or_make(m_lock, m_disks, number, [&] { return make_disk(m_basis, radius, m_reach); });
}

std::shared_ptr<const PointTable> SurfaceKernels::point(int octave)
{
    return find_or_make(m_lock, m_points, octave,
                        [&] { return make_point(m_basis, std::ldexp(1.0f, octave), m_reach, m_tolerance); });
}

std::size_t SurfaceKernels::bytes() const
{
    const std::lock_guard guard(m_lock);
    std::size_t sum = 0;
    for (const auto& [number, disk] : m_disks)
        sum += disk->light.bytes() + disk->excess.size() * disk->excess.front().size() * sizeof(float);
    for (const auto& [octave, point] : m_points)
        sum += point->light.bytes() + point->laplacian.bytes();
    for (const std::vector<ScaledProfile>& profiles : m_basis.terms.basis.profiles)
        sum += profiles.size() * 2 * edge_count * sizeof(Harmonics);
    return sum;
}

}  // namespace beamspread
