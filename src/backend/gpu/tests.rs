//! The shaders against f64, the plan's rows as they read them, and what a device does over several frames.

mod footprints;
mod looks;
mod mutants;
mod panoramas;
mod pictures;
mod reflected;
mod searches;
mod twins;

use std::io::Write as _;
use std::sync::Once;

use super::device::{Gpu as Device, Limits};
use super::records::Row;

/// A device for a test; `None` where there is no adapter, which is said. With `CATOPTRIC_REQUIRE_GPU=1` that is a failure.
fn device() -> Option<Device> {
    match Device::open(None, Limits::Adapter) {
        Ok(device) => {
            static SAID: Once = Once::new();
            SAID.call_once(|| {
                let _ = writeln!(std::io::stderr(), "GPU: tested on {}", device.name);
            });
            Some(device)
        }
        Err(error) => {
            let required = std::env::var("CATOPTRIC_REQUIRE_GPU").is_ok_and(|v| v == "1");
            assert!(!required, "{error}");
            let _ = writeln!(std::io::stderr(), "GPU: not tested (no adapter)");
            None
        }
    }
}

/// Runs an entry point `main` over some inputs: `plan`, four-number inputs and as many outputs as are asked for.
fn run(
    gpu: &Device,
    text: &str,
    lists: &[(u32, &[Row])],
    outputs: usize,
    groups: u32,
) -> Vec<[f32; 4]> {
    run_with(gpu, text, lists, &[], outputs, groups)
}

/// [`run`], with textures by binding.
fn run_with(
    gpu: &Device,
    text: &str,
    lists: &[(u32, &[Row])],
    textures: &[(u32, &wgpu::TextureView)],
    outputs: usize,
    groups: u32,
) -> Vec<[f32; 4]> {
    use wgpu::BufferUsages as U;
    let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(text.into()),
    });
    let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: None,
        module: &module,
        entry_point: Some("main"),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    });
    let bytes = outputs as u64 * 16;
    let made = |bytes: u64, usage| gpu.buffer("test", bytes, usage).expect("room");
    let out = made(bytes, U::STORAGE | U::COPY_SRC);
    let back = made(bytes, U::COPY_DST | U::MAP_READ);
    let mut buffers = Vec::new();
    for (binding, list) in lists {
        let usage = if *binding == 0 { U::UNIFORM } else { U::STORAGE };
        let buffer = made(size_of_val(*list) as u64, usage | U::COPY_DST);
        gpu.queue.write_buffer(&buffer, 0, bytemuck::cast_slice(list));
        buffers.push((*binding, buffer));
    }
    buffers.push((20, out.clone()));
    let buffers = buffers.iter().map(|(binding, buffer)| (*binding, buffer.as_entire_binding()));
    let views =
        textures.iter().map(|(binding, view)| (*binding, wgpu::BindingResource::TextureView(view)));
    let entries: Vec<_> = buffers
        .chain(views)
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
        .collect();
    let group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &entries,
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    {
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(&pipeline);
        pass.set_bind_group(0, &group, &[]);
        pass.dispatch_workgroups(groups, 1, 1);
    }
    encoder.copy_buffer_to_buffer(&out, 0, &back, 0, bytes);
    gpu.queue.submit([encoder.finish()]);
    gpu.read(&back, bytes, <[[f32; 4]]>::to_vec).expect("readable")
}
