//! One device, with errors as values.

use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::adapters::{choose, features};
use crate::error::{Error, Result};

/// What a device is asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Limits {
    /// Everything that the adapter has.
    #[default]
    Adapter,
    /// What every WebGPU implementation has, and no more.
    Core,
}

/// A device and its queue.
pub(super) struct Gpu {
    pub(super) name: String,
    pub(super) software: bool,
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    pub(super) limits: wgpu::Limits,
    pub(super) features: wgpu::Features,
    /// For tests: what is replaced in every shader, and by what.
    #[cfg(test)]
    pub(super) mutant: Option<[&'static str; 2]>,
    /// Buffers made so far.
    pub(super) allocations: Cell<usize>,
    lost: Arc<AtomicBool>,
}

impl Gpu {
    pub(super) fn open(wanted: Option<&str>, limits: Limits) -> Result<Self> {
        let (adapter, described) = choose(wanted)?;
        let (limits, features) = match limits {
            Limits::Adapter => (adapter.limits(), features(&adapter)),
            Limits::Core => (wgpu::Limits::default(), wgpu::Features::empty()),
        };
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("catoptric"),
            required_features: features,
            required_limits: limits.clone(),
            ..Default::default()
        };
        let name = &described.name;
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|e| failed(name, &e.to_string()))?;
        // Errors are asked for where they can happen; what comes otherwise must not end the program.
        device.on_uncaptured_error(Arc::new(|_| {}));
        Ok(Self::of(&adapter, device, queue))
    }

    /// A device that is open.
    pub(super) fn of(adapter: &wgpu::Adapter, device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let info = adapter.get_info();
        let lost = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&lost);
        device.set_device_lost_callback(move |_, _| flag.store(true, Ordering::Relaxed));
        Self {
            name: info.name,
            software: info.device_type == wgpu::DeviceType::Cpu,
            limits: device.limits(),
            features: device.features(),
            device,
            queue,
            #[cfg(test)]
            mutant: None,
            allocations: Cell::new(0),
            lost,
        }
    }

    pub(super) fn is_lost(&self) -> bool {
        self.lost.load(Ordering::Relaxed)
    }

    /// Waits for everything that was submitted.
    pub(super) fn wait(&self) {
        let _ = self.device.poll(wgpu::PollType::wait_indefinitely());
    }

    /// Runs `work`; what the device says against it is the error.
    pub(super) fn checked<T>(&self, work: impl FnOnce() -> T) -> Result<T> {
        let filters = [
            wgpu::ErrorFilter::Validation,
            wgpu::ErrorFilter::OutOfMemory,
            wgpu::ErrorFilter::Internal,
        ];
        let mut scopes = filters.map(|filter| Some(self.device.push_error_scope(filter)));
        let done = work();
        let mut found = None;
        for scope in scopes.iter_mut().rev() {
            let scope = scope.take().expect("each is popped once");
            found = pollster::block_on(scope.pop()).or(found);
        }
        match found {
            None => Ok(done),
            Some(error) => Err(failed(&self.name, &error.to_string())),
        }
    }

    /// A buffer of `bytes` bytes.
    pub(super) fn buffer(
        &self,
        label: &str,
        bytes: u64,
        usage: wgpu::BufferUsages,
    ) -> Result<wgpu::Buffer> {
        let bytes = bytes.max(16).next_multiple_of(16);
        let storage = usage.contains(wgpu::BufferUsages::STORAGE);
        let most = match storage {
            true => self.limits.max_buffer_size.min(self.limits.max_storage_buffer_binding_size),
            false => self.limits.max_buffer_size,
        };
        if bytes > most {
            return Err(Error::input(
                "--backend gpu",
                "",
                format!(
                    "{label} take {} MiB in one piece, and {} allows {} MiB",
                    bytes.div_ceil(1 << 20),
                    self.name,
                    most >> 20
                ),
                match label.starts_with("surfels") {
                    true => "use fewer --surfels, or --backend cpu",
                    false => "use a smaller --size, or --backend cpu",
                },
            ));
        }
        self.allocations.set(self.allocations.get() + 1);
        self.checked(|| {
            self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: bytes,
                usage,
                mapped_at_creation: false,
            })
        })
    }

    /// Elements of that size that one binding holds.
    #[expect(clippy::cast_possible_truncation, reason = "clamped")]
    pub(super) fn most_elements(&self, bytes: usize) -> u32 {
        let most = self.limits.max_buffer_size.min(self.limits.max_storage_buffer_binding_size);
        (most / bytes as u64).min(u64::from(u32::MAX)) as u32
    }

    /// Waits for a buffer to be readable and reads its first `bytes`.
    pub(super) fn read<T: bytemuck::Pod, R>(
        &self,
        buffer: &wgpu::Buffer,
        bytes: u64,
        use_it: impl FnOnce(&[T]) -> R,
    ) -> Result<R> {
        let (send, receive) = std::sync::mpsc::channel();
        buffer.map_async(wgpu::MapMode::Read, 0..bytes, move |done| {
            let _ = send.send(done);
        });
        self.wait();
        let mapped = receive.recv().map_err(|e| e.to_string());
        let mapped = mapped.and_then(|done| done.map_err(|e| e.to_string()));
        mapped.map_err(|e| failed(&self.name, &e))?;
        let view =
            buffer.get_mapped_range(0..bytes).map_err(|e| failed(&self.name, &e.to_string()))?;
        let result = use_it(bytemuck::cast_slice(&view));
        drop(view);
        buffer.unmap();
        Ok(result)
    }
}

fn failed(name: &str, problem: &str) -> Error {
    let problem = problem.trim().trim_end_matches('.').replace('\n', " ");
    // Drivers say it in many ways.
    let remedy = match problem.to_lowercase().contains("memory") {
        true => "use fewer --surfels or a smaller --size, or --backend cpu",
        false => "use another --adapter, or --backend cpu",
    };
    Error::input("--backend gpu", "", format!("{name} failed: {problem}"), remedy)
}
