//! Which adapters there are, and which one is meant.

use crate::error::{Error, Result};

/// What atomic keys of 64 bits need.
pub(super) const ATOMICS_64: wgpu::Features =
    wgpu::Features::SHADER_INT64.union(wgpu::Features::SHADER_INT64_ATOMIC_MIN_MAX);

/// What is used of an adapter's features: timestamps and atomic keys of 64 bits, where they are there.
pub fn features(adapter: &wgpu::Adapter) -> wgpu::Features {
    adapter.features() & (ATOMICS_64 | wgpu::Features::TIMESTAMP_QUERY)
}

/// A graphics adapter of this machine.
#[derive(Clone, Debug)]
pub struct Adapter {
    /// As the driver calls it.
    pub name: String,
    /// `Vulkan`, `Metal` or `Dx12`.
    pub api: String,
    /// Driver and version.
    pub driver: String,
    /// Its shaders run on the CPU.
    pub software: bool,
    /// Largest storage binding, bytes.
    pub binding_bytes: u64,
    /// Largest side of a picture, pixels.
    pub picture_px: u32,
    /// Storage buffers that a shader stage may use.
    pub storage_buffers: u32,
    /// Whether passes can be timed.
    pub timestamps: bool,
    /// Whether keys of 64 bits can be compared atomically.
    pub atomics_64: bool,
}

pub(super) fn instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::VULKAN | wgpu::Backends::METAL | wgpu::Backends::DX12;
    descriptor.flags = wgpu::InstanceFlags::empty();
    wgpu::Instance::new(descriptor)
}

/// Hardware first, each in the system's order.
pub(super) fn list(instance: &wgpu::Instance) -> Vec<wgpu::Adapter> {
    let mut all = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    let rank = |adapter: &wgpu::Adapter| match adapter.get_info().device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu | wgpu::DeviceType::VirtualGpu => 1,
        wgpu::DeviceType::Other => 2,
        wgpu::DeviceType::Cpu => 3,
    };
    all.sort_by_key(rank);
    all
}

fn described(adapter: &wgpu::Adapter) -> Adapter {
    let (info, limits, features) = (adapter.get_info(), adapter.limits(), adapter.features());
    Adapter {
        software: info.device_type == wgpu::DeviceType::Cpu,
        name: info.name,
        api: format!("{:?}", info.backend),
        driver: format!("{} {}", info.driver, info.driver_info).trim().to_owned(),
        binding_bytes: limits.max_storage_buffer_binding_size,
        picture_px: limits.max_texture_dimension_2d,
        storage_buffers: limits.max_storage_buffers_per_shader_stage,
        timestamps: features.contains(wgpu::Features::TIMESTAMP_QUERY),
        atomics_64: features.contains(ATOMICS_64),
    }
}

/// Whether there may be a graphics card: loading drivers to find none takes longer than a small picture.
pub fn may_be_there() -> bool {
    const DEVICES: [&str; 4] = ["/dev/dri", "/dev/nvidiactl", "/dev/dxg", "/dev/kfd"];
    !cfg!(target_os = "linux") || DEVICES.iter().any(|path| std::path::Path::new(path).exists())
}

/// All adapters, the best first.
pub fn adapters() -> Vec<Adapter> {
    list(&instance()).iter().map(described).collect()
}

/// The adapter that `wanted` names: a number of the list or a part of the name.
pub(super) fn choose(wanted: Option<&str>) -> Result<(wgpu::Adapter, Adapter)> {
    let all = list(&instance());
    let names: Vec<String> =
        all.iter().enumerate().map(|(i, a)| format!("{i} ({})", a.get_info().name)).collect();
    let found = match wanted {
        None => all.into_iter().next(),
        Some(wanted) => {
            let number = wanted.parse::<usize>().ok();
            let lower = wanted.trim().to_lowercase();
            all.into_iter().enumerate().find_map(|(i, adapter)| {
                let name = adapter.get_info().name.to_lowercase();
                let named = !lower.is_empty() && name.contains(&lower);
                (number.map_or(named, |number| number == i)).then_some(adapter)
            })
        }
    };
    let Some(adapter) = found else {
        let option = if wanted.is_some() { "--adapter" } else { "--backend gpu" };
        let (problem, remedy) = match wanted {
            Some(wanted) if !names.is_empty() => (
                format!("there is no adapter {wanted:?}"),
                format!("choose a number or a part of a name of these: {}", names.join(", ")),
            ),
            _ => (
                "no graphics adapter was found".to_owned(),
                "install a Vulkan driver, or use --backend cpu".to_owned(),
            ),
        };
        return Err(Error::input(option, "", problem, remedy));
    };
    let description = described(&adapter);
    Ok((adapter, description))
}
