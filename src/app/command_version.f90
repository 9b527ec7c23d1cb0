! SPDX-License-Identifier: MIT
!> rockdda --version
module rockdda_app_command_version
   use rockdda_base_diagnostics, only : diagnostics_type
   use rockdda_base_error, only : error_type
   use rockdda_base_version, only : version, build_description
   use rockdda_io_hdf5_adapter, only : hdf5_version
   use rockdda_app_arguments, only : command_line_type
   use rockdda_app_json, only : json_type
   use rockdda_app_process, only : print_line
   use rockdda_app_report, only : begin_json, end_json
   implicit none
   private
   public :: run_version

contains

   !> Print version, compiler, flags, options and libraries; ok is false when printing fails.
   subroutine run_version(line, ok)
      type(command_line_type), intent(in) :: line
      logical, intent(out) :: ok
      type(json_type) :: json
      type(diagnostics_type) :: messages
      type(error_type), allocatable :: none
      if (.not. line%json) then
         call print_line(build_description(), ok)
         return
      end if
      call begin_json(json, line, 'done', 0)
      call json%put('version', version)
      call json%put('hdf5', hdf5_version())
      call json%put('build', build_description())
      call end_json(json, messages, none, ok)
   end subroutine run_version

end module rockdda_app_command_version
