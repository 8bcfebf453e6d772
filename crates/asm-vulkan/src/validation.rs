//! Khronos' validation layer: instances on which it checks calls, and someone who hears what it says.

use std::ffi::{CStr, c_void};
use std::sync::Arc;

use ash::{ext, vk};

const LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

pub(crate) fn is_installed(entry: &ash::Entry) -> bool {
    // SAFETY: the loader is loaded; the call has no further conditions.
    let layers = unsafe { entry.enumerate_instance_layer_properties() }.unwrap_or_default();
    layers.iter().any(|layer| layer.layer_name_as_c_str() == Ok(LAYER))
}

fn has_settings(entry: &ash::Entry) -> bool {
    // SAFETY: the loader is loaded; the call has no further conditions.
    let found = unsafe { entry.enumerate_instance_extension_properties(Some(LAYER)) };
    let is_it = |e: &vk::ExtensionProperties| e.extension_name_as_c_str() == Ok(ext::layer_settings::NAME);
    found.unwrap_or_default().iter().any(is_it)
}

/// An instance of Vulkan 1.3; the layer, where `validated`, checks calls and the synchronization of what is submitted.
pub(crate) fn create_instance(
    entry: &ash::Entry,
    name: &CStr,
    validated: bool,
) -> Result<ash::Instance, vk::Result> {
    let application = vk::ApplicationInfo::default().application_name(name).api_version(vk::API_VERSION_1_3);
    let mut create = vk::InstanceCreateInfo::default().application_info(&application);
    let layers = [LAYER.as_ptr()];
    let extensions = [ext::debug_utils::NAME.as_ptr(), ext::validation_features::NAME.as_ptr()];
    let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
    let yes = vk::TRUE.to_ne_bytes();
    let settings = [vk::LayerSettingEXT {
        p_layer_name: LAYER.as_ptr(),
        p_setting_name: c"syncval_shader_accesses_heuristic".as_ptr(),
        ty: vk::LayerSettingTypeEXT::BOOL32,
        value_count: 1,
        p_values: yes.as_ptr().cast(),
        ..vk::LayerSettingEXT::default()
    }];
    let mut settings = vk::LayerSettingsCreateInfoEXT::default().settings(&settings);
    if validated {
        create =
            create.enabled_layer_names(&layers).enabled_extension_names(&extensions).push_next(&mut features);
        // Newer layers look at what shaders read and write only if they are asked to.
        if has_settings(entry) {
            create = create.push_next(&mut settings);
        }
    }
    // SAFETY: what `create` points to lives until the call returns.
    unsafe { entry.create_instance(&create, None) }
}

type Hear = Box<dyn Fn(String) + Send + Sync>;

/// Hears what the layer says about calls on an instance.
pub(crate) struct Messenger {
    functions: ext::debug_utils::Instance,
    raw: vk::DebugUtilsMessengerEXT,
    /// The messenger has a pointer to it.
    _hear: Arc<Hear>,
}

impl Messenger {
    /// # Safety
    /// The instance is validated, and outlives the messenger.
    pub(crate) unsafe fn new(
        entry: &ash::Entry,
        instance: &ash::Instance,
        hear: Hear,
    ) -> Result<Self, vk::Result> {
        let functions = ext::debug_utils::Instance::new(entry, instance);
        let hear = Arc::new(hear);
        let create = vk::DebugUtilsMessengerCreateInfoEXT::default()
            .message_severity(
                vk::DebugUtilsMessageSeverityFlagsEXT::ERROR | vk::DebugUtilsMessageSeverityFlagsEXT::WARNING,
            )
            .message_type(vk::DebugUtilsMessageTypeFlagsEXT::VALIDATION)
            .pfn_user_callback(Some(pass_on))
            .user_data(Arc::as_ptr(&hear).cast_mut().cast());
        // SAFETY: validated instances have the extension; the user data outlives the messenger, which `drop` destroys first.
        let raw = unsafe { functions.create_debug_utils_messenger(&create, None) }?;
        Ok(Self { functions, raw, _hear: hear })
    }
}

impl Drop for Messenger {
    fn drop(&mut self) {
        // SAFETY: the instance is alive, as `new` demands, and the messenger is not used again.
        unsafe { self.functions.destroy_debug_utils_messenger(self.raw, None) }
    }
}

/// What the layer calls.
///
/// # Safety
/// `data` points to a message, `hear` to a [`Hear`], for the time of the call.
unsafe extern "system" fn pass_on(
    _: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    hear: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: as the function demands.
    let (data, hear) = unsafe { (&*data, &*hear.cast::<Hear>()) };
    // SAFETY: strings of a message end with 0, or are null.
    let text =
        |text: *const std::ffi::c_char| unsafe { if text.is_null() { c"" } else { CStr::from_ptr(text) } };
    let [kind, message] = [data.p_message_id_name, data.p_message].map(|t| text(t).to_string_lossy());
    hear(format!("{kind}: {message}"));
    vk::FALSE
}
